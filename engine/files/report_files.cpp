#include "engine/files/report_files.hpp"

#include <fmt/format.h>

#include <exception>
#include <nlohmann/json.hpp>

#include "engine/files/output_file.hpp"
#include "engine/standard_streams.hpp"
#include "engine/text.hpp"

namespace linden {

void write_json(const std::string& file, const nlohmann::ordered_json& figures) {
  write_file(file, figures.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n');
}

bool attempt(const std::function<void()>& write) {
  try {
    write();
    return true;
  } catch (const std::exception& error) {
    tell_text(error.what());
    return false;
  }
}

}  // namespace linden
