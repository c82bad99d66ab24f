#include "goal_options.h"

#include <charconv>

namespace trisoup {
namespace {

const CLI::Validator& size_in_megabytes() {
  static const CLI::Validator validator(
      [](const std::string& text) {
        double value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        const bool number = error == std::errc() && end == text.data() + text.size();
        // From a byte to a terabyte; 0 is no goal.
        return number && (value == 0 || (value * 1048576.0 >= 1.0 && value <= 1048576.0))
                   ? std::string()
                   : "'" + text + "' is not a size of a file in megabytes";
      },
      "");
  return validator;
}

}  // namespace

void add_goal_options(CLI::App& app, CommandLine& o) {
  const char* const group =
      "Goal (the smallest model that meets it: after the last step what is worth least goes, round by round)";
  app.add_option("--target-psnr", o.target_psnr,
                 "dB, mean over validation views, which are held out of the training views")
      ->group(group);
  app.add_option("--target-ssim", o.target_ssim, "SSIM, the same")->group(group);
  app.add_option("--max-mb", o.max_megabytes, "megabytes of model.glb")->check(size_in_megabytes())->group(group);
  app.add_option("--max-triangles", o.max_triangles, "triangles, of those that there are after the last step")
      ->group(group);
  app.add_option("--validation-views", o.validation_views,
                 "how many are held out [with one of these two a tenth of the training views, 3 to 24]")
      ->group(group);
  app.add_option("--round-steps", o.round_steps,
                 "training steps after each removal [a twentieth of the steps, at least 20]")
      ->group(group);
}

void check_whole_numbers(CLI::App& app) {
  const CLI::Validator whole(
      [](const std::string& text) {
        std::uint64_t value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error == std::errc::result_out_of_range) return text + " is too large";
        return error != std::errc() || end != text.data() + text.size()
                   ? "'" + text + "' is not a whole number from 0 on"
                   : std::string();
      },
      "");
  for (CLI::Option* option : app.get_options())
    if (option->get_type_name() == "UINT") option->check(whole);
}

}  // namespace trisoup
