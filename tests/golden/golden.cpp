// golden DIR: runs the golden vectors of the published method through the kernels of a device and compares each array.
// The layout is described in golden/README.md of $TRISOUP_SHARED.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "base/error.h"
#include "golden/cases.h"
#include "gpu/device.h"

namespace fs = std::filesystem;
using namespace trisoup;

int main(int argc, char** argv) {
  CLI::App app{"Compares the kernels with golden vectors of the published method, array by array."};
  std::string folder, only;
  gpu::DeviceOptions options;
  bool quiet = false;
  app.add_option("DIR", folder, "folder of .npz cases")->required();
  app.add_option("--backend", options.backend,
                 "auto, vulkan, cuda or cpu [auto: a GPU if there is one, otherwise the CPU]");
  app.add_option("--device", options.device, "device number or name");
  app.add_option("--only", only, "run only cases whose name begins with this");
  app.add_flag("--validation", options.validation, "enable the Vulkan validation layers");
  app.add_flag("--quiet", quiet, "print only failures and the summary");
  CLI11_PARSE(app, argc, argv);
  try {
    if (!fs::is_directory(folder)) throw Error("{}: not a folder of golden cases", folder);
    auto device = gpu::open_device(options);
    std::printf("device: %s (%s)\n", device->info().name.c_str(), device->info().driver.c_str());
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder))
      if (entry.path().extension() == ".npz" && entry.path().filename().string().starts_with(only))
        files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    if (files.empty()) throw Error("{}: no .npz cases{}", folder, only.empty() ? "" : " with that name");
    int passed = 0, failed = 0, skipped = 0;
    for (const fs::path& file : files) {
      test::Report report(file.stem().string(), quiet);
      if (!test::run_case(*device, file, report)) {
        std::printf("%-34s unknown kind of case: skipped\n", file.stem().c_str());
        ++skipped;
        continue;
      }
      (report.failures() == 0 ? passed : failed)++;
    }
    for (const std::string& message : device->validation_messages()) {
      std::printf("validation: %s\n", message.c_str());
      ++failed;
    }
    std::printf("%d passed, %d failed, %d skipped\n", passed, failed, skipped);
    return failed == 0 && passed > 0 ? 0 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "golden: %s\n", e.what());
    return 1;
  }
}
