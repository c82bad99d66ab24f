#include "trisoup/settings.h"

#include "train/config/settings_table.h"

namespace trisoup {

std::vector<SettingInfo> settings() {
  std::vector<SettingInfo> all;
  for (const train::Setting& s : train::settings_table())
    if (s.access != train::Access::internal)
      all.push_back({s.name, s.group, s.help, train::allowed_values(s), train::default_values(s)});
  return all;
}

}  // namespace trisoup
