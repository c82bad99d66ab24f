#include "interface_painter.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>

#include <imgui.h>

#include "args/interface.h"

namespace trisoup::viewer {
namespace {

struct Vertex {
  float x, y, u, v;
  std::uint32_t colour, pad[3];
};

}  // namespace

InterfacePainter::InterfacePainter(gpu::Device& gpu) : gpu_(gpu), graphics_(*gpu.graphics()) {}

void InterfacePainter::load_fonts() {
  unsigned char* pixels = nullptr;
  int width = 0, height = 0;
  ImGui::GetIO().Fonts->GetTexDataAsRGBA32(&pixels, &width, &height);
  font_ = graphics_.create_image(
      {gpu::Format::rgba8, static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)}, "font");
  graphics_.upload(font_, 0, std::as_bytes(std::span(pixels, std::size_t(width) * height * 4)));
}

void InterfacePainter::paint(const ImDrawData& data, const gpu::Image& target) {
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<gpu::Draw> draws;
  kernels::InterfaceArgs args{};
  args.scale_x = 2.0f / data.DisplaySize.x;
  args.scale_y = 2.0f / data.DisplaySize.y;
  args.offset_x = -1.0f - data.DisplayPos.x * args.scale_x;
  args.offset_y = -1.0f - data.DisplayPos.y * args.scale_y;
  for (int n = 0; n < data.CmdListsCount; ++n) {
    const ImDrawList& list = *data.CmdLists[n];
    const auto first_vertex = static_cast<std::uint32_t>(vertices.size());
    for (const ImDrawVert& v : list.VtxBuffer) vertices.push_back({v.pos.x, v.pos.y, v.uv.x, v.uv.y, v.col, {}});
    for (const ImDrawCmd& command : list.CmdBuffer) {
      // Scales to the target: while a window is resized, its size can differ from the framebuffer's.
      const glm::vec2 scale(static_cast<float>(target.shape().width) / data.DisplaySize.x,
                            static_cast<float>(target.shape().height) / data.DisplaySize.y);
      const auto clip = [&](float value, float origin, float s, std::uint32_t size) {
        return std::clamp((value - origin) * s, 0.0f, static_cast<float>(size));
      };
      const gpu::ImageShape& shape = target.shape();
      const float x0 = clip(command.ClipRect.x, data.DisplayPos.x, scale.x, shape.width);
      const float y0 = clip(command.ClipRect.y, data.DisplayPos.y, scale.y, shape.height);
      const float x1 = clip(command.ClipRect.z, data.DisplayPos.x, scale.x, shape.width);
      const float y1 = clip(command.ClipRect.w, data.DisplayPos.y, scale.y, shape.height);
      if (x1 <= x0 || y1 <= y0 || command.ElemCount == 0) continue;
      gpu::Draw draw{.vertex = "interface", .fragment = "interface"};
      draw.blend = true;
      draw.vertex_vectors = 2;
      draw.first = static_cast<std::uint32_t>(indices.size());
      draw.count = command.ElemCount;
      const auto* const texture = static_cast<const gpu::Image*>(command.GetTexID());
      draw.textures = {texture ? texture : &font_};
      draw.scissor = gpu::Rectangle{static_cast<std::int32_t>(x0), static_cast<std::int32_t>(y0),
                                    static_cast<std::uint32_t>(x1) - static_cast<std::uint32_t>(x0),
                                    static_cast<std::uint32_t>(y1) - static_cast<std::uint32_t>(y0)};
      draw.set_arguments(args);
      for (unsigned i = 0; i < command.ElemCount; ++i)
        indices.push_back(first_vertex + command.VtxOffset + list.IdxBuffer[static_cast<int>(command.IdxOffset + i)]);
      draws.push_back(draw);
    }
  }
  if (draws.empty()) return;
  const auto fit = [&](gpu::Buffer& buffer, std::size_t bytes, const char* what) {
    if (buffer && buffer.bytes() >= bytes) return;
    buffer = {};
    buffer = gpu_.allocate(std::bit_ceil(bytes), what);
  };
  fit(vertices_, vertices.size() * sizeof(Vertex), "panels");
  fit(indices_, indices.size() * 4, "panels");
  gpu_.upload(vertices_.address(), vertices);
  gpu_.upload(indices_.address(), indices);
  for (gpu::Draw& draw : draws) {
    draw.vertices = vertices_.address();
    draw.indices = indices_.address();
  }
  graphics_.draw({.colour = {&target}, .clear = false}, draws);
}

}  // namespace trisoup::viewer
