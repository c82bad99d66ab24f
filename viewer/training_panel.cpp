#include "training_panel.h"

#include <cfloat>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <imgui.h>

namespace trisoup::viewer {

void training_panel(Live& live, float scale) {
  const Live::State state = live.state();
  ImGui::SetNextWindowPos({ImGui::GetIO().DisplaySize.x - 10, 10}, ImGuiCond_Always, {1.0f, 0.0f});
  ImGui::Begin("Training", nullptr, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoFocusOnAppearing);
  const float width = 260 * scale;
  ImGui::Text("%s", state.ended ? "ended" : state.paused ? "paused" : state.phase.c_str());
  if (state.steps > 0) {
    // Beside the bar: no colour of text is readable on both of its colours.
    ImGui::Text("step %llu of %llu", static_cast<unsigned long long>(state.step),
                static_cast<unsigned long long>(state.steps));
    ImGui::ProgressBar(static_cast<float>(double(state.step) / double(state.steps)), {width, 6 * scale}, "");
    ImGui::Text("%u triangles, budget %u", state.triangles, state.budget);
    ImGui::Text("%.1f ms per step, %.0f s left", state.ms_per_step,
                1e-3 * state.ms_per_step * double(state.steps - state.step));
  }
  const auto plot = [&](const char* name, const std::vector<float>& values, const char* format) {
    if (values.empty()) return;
    const auto label = fmt::format(fmt::runtime(format), values.back());
    ImGui::PlotLines(name, values.data(), static_cast<int>(values.size()), 0, label.c_str(), FLT_MAX, FLT_MAX,
                     {width, 70 * scale});
  };
  plot("loss", state.loss, "{:.4f}");
  plot("PSNR", state.psnr, "{:.2f} dB");
  if (!state.ended && state.steps > 0) {
    if (ImGui::Button(state.paused ? "Continue (T)" : "Pause (T)")) live.pause(!state.paused);
    ImGui::SameLine();
    if (ImGui::Button("One step (N)")) live.step_once();
  }
  ImGui::End();
}

}  // namespace trisoup::viewer
