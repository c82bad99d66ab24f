// make-tiny-scene DIR [SIZE] [--light X]: eight views of a coloured cube in the layout of NeRF-Synthetic, for the
// end-to-end tests.
#include <CLI/CLI.hpp>

#include <cstdio>
#include <filesystem>

#include "tiny_scene.h"

int main(int argc, char** argv) try {
  CLI::App app{"Writes eight views of a coloured cube in the layout of NeRF-Synthetic, for the end-to-end tests."};
  std::filesystem::path folder;
  int size = 24;
  app.add_option("DIR", folder, "folder to write")->required();
  app.add_option("SIZE", size, "side of the pictures in pixels [24]")->check(CLI::Range(1, 4096));
  trisoup::test::TinyScene scene;
  app.add_option("--light", scene.light, "factor of the colours of every second training view [1]")
      ->check(CLI::Range(0.0, 1.0));
  CLI11_PARSE(app, argc, argv);
  scene.width = scene.height = size;
  trisoup::test::write_tiny_scene(folder, scene);
} catch (const std::exception& e) {
  std::fprintf(stderr, "make-tiny-scene: %s\n", e.what());
  return 1;
}
