// engine/files/report_files.hpp
// What a command writes when its work is done.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace linden {

/// A file of figures for scripts: indented, text that is no UTF-8 replaced. Throws std::runtime_error as OutputFile does.
void write_json(const std::string& file, const nlohmann::ordered_json& figures);

/// Carries out what writes a file. A complaint goes to stderr, and the other files of the command are written none the less; true where
/// there was none.
bool attempt(const std::function<void()>& write);

}  // namespace linden
