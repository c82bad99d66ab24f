// make-tiny-scene DIR [SIZE]: eight views of a coloured cube in the layout of NeRF-Synthetic, for the end-to-end tests.
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
  CLI11_PARSE(app, argc, argv);
  trisoup::test::TinyScene scene;
  scene.width = scene.height = size;
  trisoup::test::write_tiny_scene(folder, scene);
} catch (const std::exception& e) {
  std::fprintf(stderr, "make-tiny-scene: %s\n", e.what());
  return 1;
}
