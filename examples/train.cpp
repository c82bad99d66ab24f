// train DATASET OUT [STEPS]: trains a small model on the CPU, saves it to OUT/model.glb and draws the first test view
// to OUT/view.png.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>

#include <trisoup/trisoup.h>

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: train DATASET OUT [STEPS]\n");
    return 1;
  }
  try {
    const std::filesystem::path out = argv[2];
    std::filesystem::create_directories(out);
    std::printf("trisoup %s\n", trisoup::version);

    trisoup::Device device("cpu");
    const trisoup::Dataset dataset(argv[1]);
    for (const std::string& line : dataset.warnings()) std::fprintf(stderr, "warning: %s\n", line.c_str());
    std::printf("%s: %zu training and %zu test views\n", device.name().c_str(), dataset.training_views().size(),
                dataset.test_views().size());

    trisoup::TrainingOptions options;
    options.preset = "fast";
    options.steps = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 200;
    trisoup::Training training(device, dataset, options);
    training.run(
        [](const trisoup::TrainingProgress& p) {
          std::printf("step %llu: loss %.4f, %u triangles\n", static_cast<unsigned long long>(p.step), p.loss,
                      p.triangles);
          return true;  // false: stop training
        },
        50);

    const trisoup::Model model = training.model();
    model.write(out / "model.glb");
    model.render(device, dataset.test_views().at(0).camera).write_png(out / "view.png");
    const trisoup::Quality quality = model.quality(device, dataset);
    std::printf("%zu triangles, %zu bytes, test PSNR %.2f dB\n", model.triangles(), model.bytes(), quality.psnr);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "train: %s\n", e.what());
    return 1;
  }
}
