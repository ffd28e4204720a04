#include "layout/archive.hpp"

namespace linden {

std::string sealed(std::string_view line, std::string_view bytes) {
  std::string result(line);
  result += bytes;
  const std::uint64_t sum = checksum(result);
  return result.append(reinterpret_cast<const char*>(&sum), sizeof(sum));
}

std::string_view unsealed(std::string_view line, std::string_view kind, std::string_view what, std::string_view bytes,
                          const std::string& name) {
  if (!bytes.starts_with(line) && bytes.starts_with(kind)) {
    throw InputError(fmt::format("{}: this {} was written by another version of linden, in another format; expected one that begins with "
                                 "\"{}\"; write it again",
                                 name, what, line.substr(0, line.size() - 1)));
  }
  if (!bytes.starts_with(line)) throw InputError(fmt::format("{}: this is no {} of linden", name, what));
  std::uint64_t sum = 0;
  const bool complete = bytes.size() >= line.size() + sizeof(sum);
  if (complete) std::memcpy(&sum, bytes.data() + bytes.size() - sizeof(sum), sizeof(sum));
  const std::string_view summed = bytes.substr(0, bytes.size() - (complete ? sizeof(sum) : 0));
  if (!complete || sum != checksum(summed)) {
    throw InputError(fmt::format("{}: the {} is damaged or cut short: its checksum is not that of its bytes; take another", name, what));
  }
  return summed.substr(line.size());
}

}  // namespace linden
