// Decodes photographs and makes the images of views from them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "scene/lens/photograph.h"
#include "scene/load/consistency.h"
#include "scene/load/shot.h"

namespace trisoup::scene {

/// What decoding found of one photograph.
struct Decoded {
  std::string problem;        // why it cannot be decoded; empty: it was
  std::string mask_problem;   // why its mask cannot
  bool mask_is_idle = false;  // its mask leaves out no pixel
  AlphaFound alpha = AlphaFound::none;
  std::vector<std::string> notes;  // what the decoder worked around (DecodeOptions::notes)
};

/// Throws Error if the photographs do not fit into the memory of the machine or container. Counts only what is
/// certainly needed: four bytes per pixel of each view, and the photographs that are decoded at the same time. source:
/// the file, for the message.
void check_memory(const std::vector<const Shot*>& shots, const LoadOptions& options, const std::string& source);

/// Decodes about `count` evenly spaced photographs, reduced to `longest_side` pixels. Those that cannot be decoded are
/// left out here; decode() reports them.
std::vector<Probe> take_probes(const std::vector<Shot>& shots, std::size_t count, int longest_side,
                               const LoadOptions& options);

/// Decodes the shots into `images`, one per shot, and returns the grey level of the background on which they are
/// composited. A photograph that cannot be decoded leaves its image empty. decoded: one per shot. Warns of what
/// decoders worked around and of masks that cannot be read; throws Error if these are more than half of the masks.
std::uint8_t decode(const std::vector<const Shot*>& shots, const std::vector<Image*>& images,
                    const LoadOptions& options, std::vector<Decoded>& decoded);

}  // namespace trisoup::scene
