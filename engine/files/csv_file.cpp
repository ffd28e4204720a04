// Numbers have 17 significant digits: they read back to the same doubles. A name that holds a comma or a quote is quoted (RFC 4180).
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <numeric>
#include <stdexcept>
#include <string_view>
#include <unordered_set>
#include <utility>

#include "engine/files/array_file.hpp"
#include "engine/files/output_file.hpp"

namespace linden {
namespace {

std::string csv_cell(const std::string& name) {
  if (name.find_first_of(",\"\r\n") == name.npos) return name;
  std::string cell = "\"";
  for (const char c : name) cell.append(c == '"' ? 2 : 1, c);
  return cell + '"';
}

/// No two are alike: a name that another column had before, such as that of a joint "time", is followed by _2, or by _3 and so on where
/// there is a column called that.
std::vector<std::string> distinct(std::vector<std::string> columns) {
  std::unordered_set<std::string> taken(columns.begin(), columns.end()), seen;
  for (std::string& column : columns) {
    if (seen.insert(column).second) continue;
    int k = 2;
    while (!taken.insert(fmt::format("{}_{}", column, k)).second) ++k;
    column = fmt::format("{}_{}", column, k);
  }
  return columns;
}

class CsvFile final : public ArrayFile {
 public:
  explicit CsvFile(const std::string& file) : out_(file) {}

  void add_numbers(const std::string&, ElementType type, std::vector<std::int64_t> row, std::vector<std::string> columns) override {
    const auto count = static_cast<std::size_t>(std::accumulate(row.begin(), row.end(), std::int64_t{1}, std::multiplies<>()));
    arrays_.push_back({type, columns.size() == count ? count : 0});
    if (columns.size() == count) columns_.insert(columns_.end(), columns.begin(), columns.end());
  }

  void add_fixed(const std::string&, std::vector<std::int64_t>, std::span<const double>) override {}

  void add_words(const std::string&, std::span<const std::string>) override {}

  void append(std::span<const void* const> rows) override {
    if (std::exchange(begins_, false)) {
      const char* gap = "";
      for (const std::string& column : distinct(columns_)) fmt::format_to(std::back_inserter(text_), "{}{}", std::exchange(gap, ","), csv_cell(column));
      write();
    }
    const char* gap = "";
    for (std::size_t k = 0; k < rows.size(); ++k) {
      for (std::size_t i = 0; i < arrays_[k].columns; ++i) {
        fmt::format_to(std::back_inserter(text_), "{}{:.17g}", std::exchange(gap, ","), number(arrays_[k].type, rows[k], i));
      }
    }
    write();
  }

  void commit() override {
    in_place_ = false;
    try {
      out_.commit();
    } catch (const std::runtime_error&) {
      out_.settle();
      if (out_.records() > 1) out_.commit();
      in_place_ = out_.records() > 1;
      throw;
    }
    in_place_ = true;
  }

  std::int64_t rows() const override { return in_place_ ? std::max<std::int64_t>(out_.records() - 1, 0) : 0; }

 private:
  struct Array {
    ElementType type;
    std::size_t columns;  // none where it is not in the table
  };

  static double number(ElementType type, const void* row, std::size_t i) {
    if (type == ElementType::float32) return static_cast<double>(static_cast<const float*>(row)[i]);
    if (type == ElementType::uint8) return static_cast<double>(static_cast<const unsigned char*>(row)[i]);
    return static_cast<const double*>(row)[i];
  }

  void write() {
    text_.push_back('\n');
    out_.write({text_.data(), text_.size()});
    text_.clear();
  }

  OutputFile out_;
  std::vector<Array> arrays_;
  std::vector<std::string> columns_;
  fmt::memory_buffer text_;
  bool begins_ = true, in_place_ = true;  // false: a commit has failed
};

}  // namespace

std::unique_ptr<ArrayFile> csv_file(const std::string& file) { return std::make_unique<CsvFile>(file); }

}  // namespace linden
