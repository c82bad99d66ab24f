#include "image/colour_profile.h"

#include <lcms2.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <type_traits>

#include "base/error.h"

namespace trisoup {
namespace {

struct CloseLcms {
  void operator()(cmsContext context) const { cmsDeleteContext(context); }
};
struct CloseProfile {
  void operator()(void* profile) const { cmsCloseProfile(profile); }
};
struct CloseTransform {
  void operator()(void* transform) const { cmsDeleteTransform(transform); }
};
struct FreeCurve {
  void operator()(cmsToneCurve* curve) const { cmsFreeToneCurve(curve); }
};
using Lcms = std::unique_ptr<std::remove_pointer_t<cmsContext>, CloseLcms>;
using Profile = std::unique_ptr<void, CloseProfile>;
using Transform = std::unique_ptr<void, CloseTransform>;

constexpr std::array<double, 8> kSrgb{0.3127, 0.3290, 0.64, 0.33, 0.30, 0.60, 0.15, 0.06};

/// IEC 61966-2-1: exponent and linear part of the curve of sRGB, as lcms2 has its parameters.
cmsToneCurve* srgb_curve(cmsContext context) {
  const cmsFloat64Number parameters[5]{2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
  return cmsBuildParametricToneCurve(context, 4, parameters);
}

/// Returns the profile of a colour space, or null if its ICC profile is damaged or its numbers are impossible.
Profile profile_of(cmsContext context, const ColourSpace& colours) {
  if (!colours.icc.empty())
    return Profile(
        cmsOpenProfileFromMemTHR(context, colours.icc.data(), static_cast<cmsUInt32Number>(colours.icc.size())));
  const std::array<double, 8> c = colours.chromaticities.value_or(kSrgb);
  const cmsCIExyY white{c[0], c[1], 1};
  const cmsCIExyYTRIPLE primaries{{c[2], c[3], 1}, {c[4], c[5], 1}, {c[6], c[7], 1}};
  const std::unique_ptr<cmsToneCurve, FreeCurve> curve(colours.gamma ? cmsBuildGamma(context, *colours.gamma)
                                                                     : srgb_curve(context));
  if (!curve) return nullptr;
  cmsToneCurve* const curves[3]{curve.get(), curve.get(), curve.get()};
  return Profile(cmsCreateRGBProfileTHR(context, &white, &primaries, curves));
}

/// Returns whether the transform of RGBA changes a colour of a grid by more than rounding.
bool changes_colours(cmsHTRANSFORM transform) {
  constexpr int kLevels = 18, kStep = 15;  // 0, 15, ..., 255
  std::vector<std::uint8_t> before, after(std::size_t(4) * kLevels * kLevels * kLevels);
  for (int r = 0; r < kLevels; ++r)
    for (int g = 0; g < kLevels; ++g)
      for (int b = 0; b < kLevels; ++b)
        for (const int value : {r * kStep, g * kStep, b * kStep, 255}) before.push_back(std::uint8_t(value));
  cmsDoTransform(transform, before.data(), after.data(), static_cast<cmsUInt32Number>(before.size() / 4));
  for (std::size_t i = 0; i < before.size(); ++i)
    if (i % 4 != 3 && std::abs(int(before[i]) - int(after[i])) > 1) return true;
  return false;
}

bool is_grey(const Image& image) {
  for (std::size_t i = 0; i < image.rgba.size(); i += 4)
    if (image.rgba[i] != image.rgba[i + 1] || image.rgba[i] != image.rgba[i + 2]) return false;
  return true;
}

/// Converts grey levels through a table of the 256 results.
void convert_grey(Image& image, cmsHTRANSFORM transform) {
  std::array<std::uint8_t, 256> before{};
  std::array<std::array<std::uint8_t, 3>, 256> after{};
  for (std::size_t i = 0; i < 256; ++i) before[i] = static_cast<std::uint8_t>(i);
  cmsDoTransform(transform, before.data(), after.data(), 256);
  bool changes = false;
  for (std::size_t i = 0; i < 256; ++i) changes = changes || std::abs(int(i) - int(after[i][1])) > 1;
  if (!changes) return;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    const std::array<std::uint8_t, 3>& colour = after[image.rgba[i]];
    std::copy(colour.begin(), colour.end(), &image.rgba[i]);
  }
}

}  // namespace

ColourSpace adobe_rgb() {
  return {{}, std::array<double, 8>{0.3127, 0.3290, 0.64, 0.33, 0.21, 0.71, 0.15, 0.06}, 563.0 / 256.0};
}

ColourSpace colour_space_of_codes(unsigned primaries, unsigned transfer, const std::string& name) {
  constexpr unsigned kGamma22 = 4, kGamma28 = 5, kLinear = 8, kPq = 16, kHlg = 18;
  constexpr unsigned kBt470M = 4, kBt470Bg = 5, kBt601 = 6, kSmpte240 = 7, kBt2020 = 9, kP3Dci = 11, kP3D65 = 12;
  if (transfer == kPq || transfer == kHlg)
    throw Error("{}: has high dynamic range ({}), which is not read; export it with standard dynamic range, or as JPEG",
                name, transfer == kPq ? "PQ" : "HLG");
  ColourSpace colours;
  if (transfer == kGamma22) colours.gamma = 2.2;
  if (transfer == kGamma28) colours.gamma = 2.8;
  if (transfer == kLinear) colours.gamma = 1;
  switch (primaries) {
    case kBt470M:
      colours.chromaticities = {0.310, 0.316, 0.67, 0.33, 0.21, 0.71, 0.14, 0.08};
      break;
    case kBt470Bg:
      colours.chromaticities = {0.3127, 0.3290, 0.64, 0.33, 0.29, 0.60, 0.15, 0.06};
      break;
    case kBt601:
    case kSmpte240:
      colours.chromaticities = {0.3127, 0.3290, 0.630, 0.340, 0.310, 0.595, 0.155, 0.070};
      break;
    case kBt2020:
      colours.chromaticities = {0.3127, 0.3290, 0.708, 0.292, 0.170, 0.797, 0.131, 0.046};
      break;
    case kP3Dci:
      colours.chromaticities = {0.314, 0.351, 0.680, 0.320, 0.265, 0.690, 0.150, 0.060};
      break;
    case kP3D65:
      colours.chromaticities = {0.3127, 0.3290, 0.680, 0.320, 0.265, 0.690, 0.150, 0.060};
      break;
    default:
      break;
  }
  return colours;
}

void convert_to_srgb(Image& image, const ColourSpace& colours, std::vector<std::string>* notes) {
  if (colours.empty()) return;
  constexpr const char* damaged = "have a damaged colour profile; their colours are used as stored";
  const Lcms context(cmsCreateContext(nullptr, nullptr));
  if (!context) throw Error("the colour conversion cannot start; free some memory");
  const Profile from = profile_of(context.get(), colours), to = profile_of(context.get(), {});
  if (!from || !to) return add_note(notes, damaged);
  const auto transform_of = [&](cmsUInt32Number input, cmsUInt32Number output) {
    return Transform(cmsCreateTransformTHR(context.get(), from.get(), input, to.get(), output,
                                           INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOCACHE | cmsFLAGS_COPY_ALPHA));
  };
  const cmsColorSpaceSignature space = cmsGetColorSpace(from.get());
  if (space == cmsSigGrayData && is_grey(image)) {
    const Transform transform = transform_of(TYPE_GRAY_8, TYPE_RGB_8);
    if (!transform) return add_note(notes, damaged);
    return convert_grey(image, transform.get());
  }
  if (space != cmsSigRgbData)
    return add_note(notes, "have a colour profile that is not one of RGB; it is not used, so colours may be off");
  const Transform transform = transform_of(TYPE_RGBA_8, TYPE_RGBA_8);
  if (!transform) return add_note(notes, damaged);
  if (!changes_colours(transform.get())) return;
  // In rows, because lcms2 counts pixels with 32 bits.
  const std::size_t row = std::size_t(4) * std::size_t(image.width);
  for (std::size_t y = 0; y < std::size_t(image.height); ++y) {
    std::uint8_t* pixels = image.rgba.data() + y * row;
    cmsDoTransform(transform.get(), pixels, pixels, static_cast<cmsUInt32Number>(image.width));
  }
}

RowsToSrgb::RowsToSrgb(double white_x, double white_y)
    : white_{white_x / white_y, 1, (1 - white_x - white_y) / white_y} {
  const auto context = cmsCreateContext(nullptr, nullptr);
  context_ = context;
  const Profile from(cmsCreateLab4ProfileTHR(context, nullptr)), to = profile_of(context, {});
  if (from && to)
    transform_ = cmsCreateTransformTHR(context, from.get(), TYPE_Lab_DBL, to.get(), TYPE_RGBA_8,
                                       INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOCACHE);
}

RowsToSrgb::RowsToSrgb(const std::string& cmyk_profile) {
  const auto context = cmsCreateContext(nullptr, nullptr);
  context_ = context;
  const Profile from = profile_of(context, {cmyk_profile, std::nullopt, std::nullopt}), to = profile_of(context, {});
  if (from && to && !cmyk_profile.empty() && cmsGetColorSpace(from.get()) == cmsSigCmykData)
    transform_ = cmsCreateTransformTHR(context, from.get(), TYPE_CMYK_16, to.get(), TYPE_RGBA_8,
                                       INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOCACHE);
}

RowsToSrgb::~RowsToSrgb() {
  if (transform_ != nullptr) cmsDeleteTransform(transform_);
  cmsDeleteContext(static_cast<cmsContext>(context_));
}

void RowsToSrgb::convert(double* lab, std::uint8_t* rgba, int width) const {
  const cmsCIEXYZ white{white_[0], white_[1], white_[2]};
  for (int x = 0; x < width; ++x) {
    cmsCIELab colour{lab[3 * x], lab[3 * x + 1], lab[3 * x + 2]};
    cmsCIEXYZ light, adapted;
    cmsLab2XYZ(&white, &light, &colour);
    if (!cmsAdaptToIlluminant(&adapted, &white, cmsD50_XYZ(), &light)) continue;
    cmsXYZ2Lab(cmsD50_XYZ(), &colour, &adapted);
    lab[3 * x] = colour.L, lab[3 * x + 1] = colour.a, lab[3 * x + 2] = colour.b;
  }
  cmsDoTransform(transform_, lab, rgba, static_cast<cmsUInt32Number>(width));
}

void RowsToSrgb::convert(const std::uint16_t* cmyk, std::uint8_t* rgba, int width) const {
  cmsDoTransform(transform_, cmyk, rgba, static_cast<cmsUInt32Number>(width));
}

}  // namespace trisoup
