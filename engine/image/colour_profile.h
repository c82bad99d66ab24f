// Conversion of photographs to sRGB.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "image/image.h"

namespace trisoup {

/// What a file says about its colours. Empty: sRGB.
struct ColourSpace {
  std::string icc{};  // ICC profile; takes precedence over the other members
  /// Chromaticities x, y of white, red, green and blue.
  std::optional<std::array<double, 8>> chromaticities{};
  /// Exponent of the transfer function from file to light, such as 2.2. nullopt: that of sRGB.
  std::optional<double> gamma{};

  bool empty() const { return icc.empty() && !chromaticities && !gamma; }
};

/// Colour space Adobe RGB (1998).
ColourSpace adobe_rgb();

/// Colour space of the codes for primaries and transfer in ITU-T H.273, which HEIC, AVIF and PNG use. Unknown codes
/// count as sRGB. The curves of BT.709, BT.601 and BT.2020 count as that of sRGB, as in picture viewers. Throws Error
/// that begins with `name` for high dynamic range (PQ, HLG), which has no conversion to sRGB without a choice of tones.
ColourSpace colour_space_of_codes(unsigned primaries, unsigned transfer, const std::string& name);

/// Converts colours to sRGB, relative colorimetric, with lcms2. Alpha stays. The pixels stay the same if the colour
/// space differs from sRGB by at most 1 of 255, as many embedded copies of sRGB do. A profile that cannot be used
/// (damaged, or not of RGB or grey) changes nothing and adds a note to `notes`, unless that is null: a phrase about
/// several photographs, such as "have a damaged colour profile; ...".
void convert_to_srgb(Image& image, const ColourSpace& colours, std::vector<std::string>* notes);

/// Converts rows of pixels that are not stored as RGB or grey.
class RowsToSrgb {
 public:
  /// Pixels are CIE L*a*b*, L 0 to 100. white_x, white_y: chromaticity of its white.
  RowsToSrgb(double white_x, double white_y);
  /// Pixels are inks of a printer, cyan, magenta, yellow and black, 0 to 65535, as its ICC profile describes.
  explicit RowsToSrgb(const std::string& cmyk_profile);
  ~RowsToSrgb();
  RowsToSrgb(const RowsToSrgb&) = delete;
  RowsToSrgb& operator=(const RowsToSrgb&) = delete;

  /// False if the profile cannot be used.
  bool valid() const { return transform_ != nullptr; }
  /// lab: [width * 3]; changed to that of D50. Writes RGB of [width * 4] and leaves A.
  void convert(double* lab, std::uint8_t* rgba, int width) const;
  /// cmyk: [width * 4].
  void convert(const std::uint16_t* cmyk, std::uint8_t* rgba, int width) const;

 private:
  std::array<double, 3> white_{};  // X, Y, Z of Lab's white
  void* context_ = nullptr;
  void* transform_ = nullptr;
};

/// Adds a note about a file unless `notes` is null.
inline void add_note(std::vector<std::string>* notes, const char* note) {
  if (notes != nullptr) notes->emplace_back(note);
}

}  // namespace trisoup
