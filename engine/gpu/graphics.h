// The drawing interface of a device: images, the rasteriser, and window surfaces.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "gpu/device.h"

namespace trisoup::gpu {

enum class Format {
  r8,
  rgba8,
  r32_uint,
  rgba32_uint,
  depth32,
  window,  // the window's own format; only Surface::next creates such images, and they cannot be read
};
constexpr std::uint32_t bytes_per_pixel(Format format) {
  return format == Format::r8 ? 1 : format == Format::rgba32_uint ? 16 : 4;
}

struct ImageShape {
  Format format = Format::rgba8;
  std::uint32_t width = 0, height = 0;  // pixels
  std::uint32_t layers = 0;             // 0: a plain image; else an array of that many layers
  std::uint32_t samples = 1;            // per pixel: 1 or 4
  bool operator==(const ImageShape&) const = default;
};

class Graphics;

/// An image in device memory, freed by the destructor. The initial contents are undefined.
class Image {
 public:
  Image() = default;
  Image(Graphics& graphics, std::uint32_t id, const ImageShape& shape) : graphics_(&graphics), id_(id), shape_(shape) {}
  Image(Image&& other) noexcept { swap(other); }
  Image& operator=(Image&& other) noexcept {
    Image taken(std::move(other));
    swap(taken);
    return *this;
  }
  ~Image();
  std::uint32_t id() const { return id_; }
  const ImageShape& shape() const { return shape_; }
  explicit operator bool() const { return graphics_ != nullptr; }

 private:
  void swap(Image& other) {
    std::swap(graphics_, other.graphics_);
    std::swap(id_, other.id_);
    std::swap(shape_, other.shape_);
  }
  Graphics* graphics_ = nullptr;
  std::uint32_t id_ = 0;
  ImageShape shape_;
};

/// Depth test. Depth is reversed: 1 is near, 0 is far. Depth is cleared to 0.
enum class Depth {
  off,
  nearest,  // keeps the fragment with the largest depth and writes its depth
  drawn,    // for draws at depth 0: passes at pixels that were drawn before; does not write depth
};

struct Rectangle {
  std::int32_t x = 0, y = 0;
  std::uint32_t width = 0, height = 0;
};

/// One draw call: a list of triangles, without culling.
struct Draw {
  const char* vertex;                         // shaders/<vertex>.vert
  const char* fragment;                       // shaders/<fragment>.frag
  std::vector<std::uint32_t> constants = {};  // specialisation constants 0, 1, ... of both shaders
  Depth depth = Depth::off;
  bool blend = false;                  // alpha blending over the existing colour
  Address vertices = 0;                // 0: the vertex shader has no vertex buffer
  std::uint32_t vertex_vectors = 0;    // 32-bit 4-vectors per vertex: locations 0, 1, ... as floats, the last as uints
  Address indices = 0;                 // 32-bit; 0: none
  std::uint32_t first = 0, count = 0;  // range of vertices, or of indices if there are any
  std::vector<const Image*> textures = {};  // bindings 0, 1, ...; nearest filter, clamped to the edge
  /// Address and size in bytes of the uniform buffers: bindings 4, 5, ...
  std::vector<std::pair<Address, std::uint64_t>> uniforms = {};
  std::optional<Rectangle> scissor = {};
  std::array<std::byte, kMaxArgumentBytes> arguments{};  // push constants of both shaders
  std::uint32_t argument_bytes = 0;

  template <typename Args>
  void set_arguments(const Args& args) {
    static_assert(std::is_trivially_copyable_v<Args> && sizeof(Args) <= kMaxArgumentBytes && sizeof(Args) % 4 == 0);
    std::memcpy(arguments.data(), &args, sizeof(Args));
    argument_bytes = sizeof(Args);
  }
};

/// One launch of a kernel that reads images and writes one image, with one thread per pixel.
struct Compute {
  const char* kernel;                         // shaders/<kernel>.comp, with workgroups of 8 x 8 threads
  std::vector<std::uint32_t> constants = {};  // specialisation constants 0, 1, ...
  std::vector<const Image*> textures = {};    // as in Draw
  std::vector<std::pair<Address, std::uint64_t>> uniforms = {};
};

/// Render targets: images with the same size and number of samples. Colour k receives the fragment shader's output at
/// location k.
struct Targets {
  std::vector<const Image*> colour;
  const Image* depth = nullptr;
  /// true: clears rgba8 and window colours to `background`, other colours to 0, and depth to the far plane. false:
  /// keeps the contents.
  bool clear = true;
  bool keep_depth = false;  // with clear: keeps the depth
  glm::vec4 background{0.0f};
};

/// The surface of a window. Frames are drawn directly to its images, so showing them needs no copy.
class Surface {
 public:
  virtual ~Surface() = default;
  /// Returns the image for the next frame, with undefined contents. Returns null if there is none at the moment,
  /// because the window has no area or is changing; try again after the next window event. width, height: size of the
  /// window's framebuffer in pixels; the image may differ in size while the window is resized. The image is valid until
  /// show() or the next call. If it was not shown, the next call returns the same image.
  virtual const Image* next(std::uint32_t width, std::uint32_t height) = 0;
  /// Shows the image. Returns false if the window could not show it; draw it again after the next window event.
  virtual bool show() = 0;
};

/// The drawing interface of a Device. It shares the in-order stream and the errors of the Device.
class Graphics {
 public:
  virtual ~Graphics() = default;
  /// Throws Error if there is not enough memory or a side exceeds max_side(). `what` describes the image in messages.
  virtual Image create_image(const ImageShape& shape, std::string_view what) = 0;
  virtual std::uint32_t max_side() const = 0;
  /// Fractional bits of the pixel coordinates to which the rasteriser rounds vertices. Vulkan guarantees 4; most
  /// devices have 8.
  virtual std::uint32_t subpixel_bits() const = 0;
  /// Returns whether images of this format can have this number of samples per pixel.
  virtual bool can_multisample(Format format, std::uint32_t samples) const = 0;
  /// Transfers one whole layer: rows from the top, tightly packed, one sample per pixel.
  virtual void upload(const Image& image, std::uint32_t layer, std::span<const std::byte> bytes) = 0;
  virtual void download(const Image& image, std::uint32_t layer, std::span<std::byte> bytes) = 0;  // waits
  virtual void draw(const Targets& targets, std::span<const Draw> draws) = 0;
  /// Runs a kernel that writes the whole plain rgba8 image `target`, which is binding 6 of the kernel.
  virtual void compute(const Compute& call, const Image& target) = 0;
  /// Copies a plain rgba8 image to another one or to a window's image, with a bilinear filter if their sizes differ.
  virtual void copy(const Image& from, const Image& to) = 0;
  void draw(const Targets& targets, const Draw& one) { draw(targets, std::span(&one, 1)); }
  /// create: creates the window's VkSurfaceKHR for a VkInstance, as window libraries do. The device must have been
  /// opened with the extensions of that library (DeviceOptions::window_extensions).
  virtual std::unique_ptr<Surface> open_surface(const std::function<std::uint64_t(void* instance)>& create) = 0;
  /// Returns the word that remember() last stored under this name for this device and driver version, in this or an
  /// earlier process; empty if there is none.
  virtual std::string recall(const std::string& name) const = 0;
  /// Stores a word in a file next to the pipeline cache, or only until the device closes if the file cannot be written.
  virtual void remember(const std::string& name, const std::string& word) noexcept = 0;

 protected:
  friend class Image;
  virtual void free_image(std::uint32_t id) = 0;
};

/// Returns the drawing interface of the device. Throws Error if it has none.
Graphics& graphics_of(Device& gpu);

/// Recreates the image if its shape differs from `shape`.
void fit(Graphics& graphics, Image& image, const ImageShape& shape, std::string_view what);

inline Image::~Image() {
  if (graphics_) graphics_->free_image(id_);
}

}  // namespace trisoup::gpu
