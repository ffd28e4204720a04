#include "engine/view/glb.hpp"

#include <algorithm>
#include <bit>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>

namespace linden {
namespace {

using Json = nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "numbers of a GLB file are written as they are in memory");

void append(std::string& bytes, std::uint64_t number) {
  const auto word = static_cast<std::uint32_t>(number);
  bytes.append(reinterpret_cast<const char*>(&word), sizeof word);
}

constexpr std::uint64_t kGlbHeader = 12, kChunkGlbHeader = 8;
constexpr std::uint32_t kGlbMagic = 0x46546c67, kGlbVersion = 2, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;

}  // namespace

void GlbRoom::take(std::uint64_t bytes) {
  if (bytes > left_) throw std::runtime_error(refusal_);
  left_ -= bytes;
}

std::string json_text(const Json& entry) { return entry.dump(-1, ' ', false, Json::error_handler_t::replace); }

std::string plain_name(std::string_view name) {
  constexpr std::string_view replacement = "\xef\xbf\xbd";
  std::string plain;
  for (std::size_t at = 0; at < name.size(); ++at) {
    const auto byte = static_cast<unsigned char>(name[at]);
    const auto next = static_cast<unsigned char>(at + 1 < name.size() ? name[at + 1] : 0);
    const bool second_set = byte == 0xc2 && next >= 0x80 && next < 0xa0;  // U+0080 to U+009F
    if (byte < 0x20 || byte == 0x7f || second_set) {
      plain += replacement;
      at += second_set ? 1 : 0;
    } else {
      plain += name[at];
    }
  }
  return plain;
}

std::size_t GlbList::add(const Json& entry) {
  const std::string text = json_text(entry);
  room_->take(text.size() + 1);
  text_ += empty() ? '[' : ',';
  text_ += text;
  return size_++;
}

void GlbList::append_to(std::string& json, const char* key) const {
  if (empty()) return;
  json += ",\"";
  json += key;
  json += "\":";
  json += text_;
  json += ']';
}

std::size_t GlbNumbers::add(View view, Component component, const char* type, std::uint64_t count, const Json& bounds) {
  const std::uint64_t width = std::string_view(type) == "SCALAR" ? 1 : std::string_view(type) == "VEC3" ? 3 : 4;
  auto place = std::ranges::find(order_, view);
  if (place == order_.end()) place = order_.insert(place, view);
  Json accessor{{"bufferView", place - order_.begin()},
                {"byteOffset", bytes_[view]},
                {"componentType", static_cast<int>(component)},
                {"count", count},
                {"type", type}};
  if (!bounds.is_null()) accessor.update(bounds);
  room_->take(4 * count * width);
  bytes_[view] += 4 * count * width;
  return accessors_.add(accessor);
}

std::uint64_t GlbNumbers::bytes() const { return std::accumulate(bytes_.begin(), bytes_.end(), std::uint64_t{0}); }

void GlbNumbers::append_to(std::string& json) const {
  constexpr int vertex_buffer = 34962, index_buffer = 34963;  // targets of the specification
  if (order_.empty()) return;
  Json entries;
  std::uint64_t offset = 0;
  for (const View view : order_) {
    Json entry{{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes_[view]}};
    if (view == vertices) entry.update({{"byteStride", 12}, {"target", vertex_buffer}});
    if (view == corners) entry["target"] = index_buffer;
    entries.push_back(entry);
    offset += bytes_[view];
  }
  accessors_.append_to(json, "accessors");
  json += R"(,"bufferViews":)" + json_text(entries) + R"(,"buffers":[{"byteLength":)" + std::to_string(offset) + "}]";
}

std::uint64_t glb_length(std::uint64_t json, std::uint64_t binary) {
  return kGlbHeader + kChunkGlbHeader + (json + 3) / 4 * 4 + (binary == 0 ? 0 : kChunkGlbHeader + binary);
}

std::string glb_head(std::string json, std::uint64_t binary) {
  const std::uint64_t length = glb_length(json.size(), binary);
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string file;
  file.reserve(length);
  for (const std::uint64_t word : {std::uint64_t{kGlbMagic}, std::uint64_t{kGlbVersion}, length}) append(file, word);
  append(file, json.size());
  append(file, kJsonChunk);
  file += json;
  if (binary > 0) {
    append(file, binary);
    append(file, kBinaryChunk);
  }
  return file;
}

}  // namespace linden
