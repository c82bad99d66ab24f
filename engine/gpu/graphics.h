// What drawing needs of a graphics API beyond compute: images, the rasteriser, and a surface to show pictures on.
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
  window,  // colours as a window takes them; images of it come from Surface::next alone, and are never read
};
constexpr std::uint32_t bytes_per_pixel(Format format) {
  return format == Format::r8 ? 1 : format == Format::rgba32_uint ? 16 : 4;
}

struct ImageShape {
  Format format = Format::rgba8;
  std::uint32_t width = 0, height = 0;  // pixels
  std::uint32_t layers = 0;             // 0: a plain image, not an array
  std::uint32_t samples = 1;            // per pixel: 1 or 4
  bool operator==(const ImageShape&) const = default;
};

class Graphics;

/// An image in device memory; freed with the object. Contents start undefined.
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

/// Depth is reversed: 1 near, 0 far, which is also what it is cleared to.
enum class Depth {
  off,
  nearest,  // keeps the fragment with the largest depth, and writes it
  drawn,    // at depth 0, passes where something else has been drawn; writes nothing
};

struct Rectangle {
  std::int32_t x = 0, y = 0;
  std::uint32_t width = 0, height = 0;
};

/// One call of the rasteriser: lists of triangles, both windings.
struct Draw {
  const char* vertex;                         // shaders/<vertex>.vert
  const char* fragment;                       // shaders/<fragment>.frag
  std::vector<std::uint32_t> constants = {};  // specialisation constants 0, 1, ... of both
  Depth depth = Depth::off;
  bool blend = false;                  // over what is there, by the colour's alpha
  Address vertices = 0;                // 0: the shader makes its own
  std::uint32_t vertex_vectors = 0;    // 32-bit 4-vectors per vertex: locations 0, 1, ... as floats, the last as uints
  Address indices = 0;                 // 32-bit; 0: none
  std::uint32_t first = 0, count = 0;  // of vertices, or of indices
  std::vector<const Image*> textures = {};                       // bindings 0.., nearest, clamped to the edge
  std::vector<std::pair<Address, std::uint64_t>> uniforms = {};  // uniform buffers and their bytes: bindings 4..
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

/// One call of a kernel that reads images and writes one, a thread a pixel.
struct Compute {
  const char* kernel;                         // shaders/<kernel>.comp, in groups of 8 x 8 threads
  std::vector<std::uint32_t> constants = {};  // specialisation constants 0, 1, ...
  std::vector<const Image*> textures = {};    // as in Draw
  std::vector<std::pair<Address, std::uint64_t>> uniforms = {};
};

/// Where draws go: images of one size and number of samples. Colour k is the fragment shader's output at location k.
struct Targets {
  std::vector<const Image*> colour;
  const Image* depth = nullptr;
  bool clear = true;  // to `background` (rgba8, a window's), 0 (others) and the far plane; else what they hold stays
  bool keep_depth = false;  // with clear: not the depth
  glm::vec4 background{0.0f};
};

/// A window's surface. Pictures are drawn on its own images, so that showing them copies nothing.
class Surface {
 public:
  virtual ~Surface() = default;
  /// The image to draw the next picture on; what it holds is undefined. Null if there is none now: the window has no
  /// area, or is changing; try again after the next event. width, height: of the window's framebuffer, in pixels; the
  /// image may have another size while that changes. It stands until show() or the next call, which gives the same
  /// image where it was not shown.
  virtual const Image* next(std::uint32_t width, std::uint32_t height) = 0;
  /// Shows what was drawn on the image. False if the window could not take it: draw it again after the next event.
  virtual bool show() = 0;
};

/// Part of a Device: the same in-order stream, and the same errors.
class Graphics {
 public:
  virtual ~Graphics() = default;
  /// Throws Error when there is no memory for it, or when it is larger than max_side(); `what` names it for people.
  virtual Image create_image(const ImageShape& shape, std::string_view what) = 0;
  virtual std::uint32_t max_side() const = 0;
  /// Bits of a pixel that vertices are rounded to before a triangle is drawn: Vulkan promises 4, most have 8.
  virtual std::uint32_t subpixel_bits() const = 0;
  /// Samples per pixel that images of the format may have.
  virtual bool can_multisample(Format format, std::uint32_t samples) const = 0;
  /// Whole layers, rows from the top, tightly packed. One sample per pixel.
  virtual void upload(const Image& image, std::uint32_t layer, std::span<const std::byte> bytes) = 0;
  virtual void download(const Image& image, std::uint32_t layer, std::span<std::byte> bytes) = 0;  // waits
  virtual void draw(const Targets& targets, std::span<const Draw> draws) = 0;
  /// Writes all of a plain rgba8 image, which is binding 6 of the kernel.
  virtual void compute(const Compute& call, const Image& target) = 0;
  /// Copies a plain rgba8 image to another, or to a window's, with a bilinear filter where their sizes differ.
  virtual void copy(const Image& from, const Image& to) = 0;
  void draw(const Targets& targets, const Draw& one) { draw(targets, std::span(&one, 1)); }
  /// create: makes the surface of a window from the instance (VkInstance to VkSurfaceKHR here), as window libraries do.
  /// The device must have been opened with the library's extensions (DeviceOptions::window_extensions).
  virtual std::unique_ptr<Surface> open_surface(const std::function<std::uint64_t(void* instance)>& create) = 0;
  /// The word that remember() was last given under this name for this device and driver version, in this or an earlier
  /// process; empty if there is none.
  virtual std::string recall(const std::string& name) const = 0;
  /// Keeps a word in a file beside the pipeline cache, or until the device closes if the file cannot be written.
  virtual void remember(const std::string& name, const std::string& word) noexcept = 0;

 protected:
  friend class Image;
  virtual void free_image(std::uint32_t id) = 0;
};

/// The device's graphics. Throws Error where it has none.
Graphics& graphics_of(Device& gpu);

/// Makes the image anew where its shape is another.
void fit(Graphics& graphics, Image& image, const ImageShape& shape, std::string_view what);

inline Image::~Image() {
  if (graphics_) graphics_->free_image(id_);
}

}  // namespace trisoup::gpu
