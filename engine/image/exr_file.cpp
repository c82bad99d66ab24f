#include "image/exr_file.h"

#include "base/error.h"

#ifdef TRISOUP_EXR

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>

namespace trisoup {
namespace {

/// Adds a channel to the header and to the values that are written.
template <typename T>
void add_exr_channel(Imf::Header& header, Imf::FrameBuffer& values, const std::string& name, const std::vector<T>& from,
                     int width) {
  constexpr Imf::PixelType kType = std::is_same_v<T, float> ? Imf::FLOAT : Imf::UINT;
  header.channels().insert(name, Imf::Channel(kType));
  // OpenEXR only reads them, but its slices are for reading files, too.
  char* const first = const_cast<char*>(reinterpret_cast<const char*>(from.data()));
  values.insert(name, Imf::Slice(kType, first, sizeof(T), sizeof(T) * static_cast<std::size_t>(width)));
}

}  // namespace

bool writes_exr() { return true; }

std::string encode_exr(int width, int height, std::span<const ExrChannel> channels) {
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer values;
  for (const ExrChannel& channel : channels)
    std::visit([&](const auto& from) { add_exr_channel(header, values, channel.name, from, width); }, channel.values);
  Imf::StdOSStream bytes;
  {
    Imf::OutputFile file(bytes, header);
    file.setFrameBuffer(values);
    file.writePixels(height);
  }  // completes the table of lines
  return bytes.str();
}

}  // namespace trisoup

#else

namespace trisoup {

bool writes_exr() { return false; }

std::string encode_exr(int, int, std::span<const ExrChannel>) {
  throw Error("EXR: this build has no OpenEXR; install libopenexr-dev and build again, or write npy");
}

}  // namespace trisoup

#endif
