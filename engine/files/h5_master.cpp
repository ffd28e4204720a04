#include "engine/files/h5_master.hpp"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <system_error>
#include <utility>

#include "engine/files/destination.hpp"
#include "engine/files/parts_folder.hpp"

namespace linden {
namespace fs = std::filesystem;

H5Master::H5Master(const std::string& file, std::vector<RecordingPart> parts)
    : out_(file), parts_(std::move(parts)), last_(H5I_INVALID_HID, H5Dclose) {
  for (const RecordingPart& part : parts_) frames_ = std::max(frames_, static_cast<hsize_t>(part.first_frame + part.frames));
}

void H5Master::fill(const Handle& creation, ElementType type) const {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  constexpr std::uint8_t kNoStatus = 255;
  if (type == ElementType::uint8) out_.call(H5Pset_fill_value, creation.id(), H5T_NATIVE_UINT8, &kNoStatus);
  else out_.call(H5Pset_fill_value, creation.id(), H5T_NATIVE_DOUBLE, &kNone);
}

void H5Master::map(const Handle& creation, const Handle& space, const std::string& name, const std::string& file,
                   std::span<const hsize_t> start, std::span<const hsize_t> count) const {
  if (std::ranges::find(count, hsize_t{0}) != count.end()) return;
  out_.call(H5Sselect_hyperslab, space.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
  const Handle there = out_.space(count);
  const std::vector<hsize_t> origin(count.size(), 0);  // from there on, also where the file has more frames
  out_.call(H5Sselect_hyperslab, there.id(), H5S_SELECT_SET, origin.data(), nullptr, count.data(), nullptr);
  out_.call(H5Pset_virtual, creation.id(), space.id(), file.c_str(), name.c_str(), there.id());
}

void H5Master::add_numbers(const std::string& name, ElementType type, std::vector<std::int64_t> row, std::vector<std::string>) {
  std::vector<hsize_t> start{0}, count{frames_};
  count.insert(count.end(), row.begin(), row.end());
  start.resize(count.size());
  const Handle space = out_.space(count), creation = out_.creation();
  fill(creation, type);
  for (const RecordingPart& part : parts_) {
    if (row.empty() && part.first_instance > 0) continue;  // time is the same in all
    start[0] = static_cast<hsize_t>(part.first_frame), count[0] = static_cast<hsize_t>(part.frames);
    if (!row.empty()) start[1] = static_cast<hsize_t>(part.first_instance), count[1] = static_cast<hsize_t>(part.instances);
    map(creation, space, name, part.file, start, count);
  }
  out_.call(H5Sselect_all, space.id());
  out_.finish(last_);
  last_ = out_.create(name, h5_types(type).first, space, creation);
}

void H5Master::describe(std::span<const std::string> names, const std::string& units) { out_.describe(last_.id(), names, units); }

void H5Master::add_fixed(const std::string& name, std::vector<std::int64_t> shape, std::span<const double>) {
  std::vector<hsize_t> start(shape.size(), 0), count(shape.begin(), shape.end());
  const Handle space = out_.space(count), creation = out_.creation();
  fill(creation, ElementType::float64);
  for (const RecordingPart& part : parts_) {
    if (part.first_frame > 0) continue;
    start[0] = static_cast<hsize_t>(part.first_instance), count[0] = static_cast<hsize_t>(part.instances);
    map(creation, space, name, part.file, start, count);
  }
  out_.call(H5Sselect_all, space.id());
  Handle dataset = out_.create(name, H5T_IEEE_F64LE, space, creation);
  out_.finish(dataset);
}

void H5Master::add_words(const std::string& name, std::span<const std::string> words) { out_.add_words(name, words); }

void H5Master::commit(const std::function<void()>& before) {
  out_.finish(last_);
  out_.publish(parts_.empty() ? "" : fs::path(parts_.front().file).parent_path().string(), before);
}

std::string parts_folder_of(const std::string& file) {
  std::error_code none;
  if (!fs::is_regular_file(file, none)) return "";
  silence();
  const Handle master(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (master.id() < 0) return "";
  const Handle time(H5Dopen2(master.id(), "time", H5P_DEFAULT), H5Dclose);
  if (time.id() < 0) return "";
  const Handle creation(H5Dget_create_plist(time.id()), H5Pclose);
  const std::vector<std::string> files = virtual_files(creation.id());
  if (files.empty()) return "";
  const std::string folder = fs::path(files.front()).parent_path().string();
  return is_parts_folder(folder) ? folder : "";
}

void remove_parts(const std::string& file, const std::string& folder) {
  if (folder.empty()) return;
  const fs::path path = Destination(file).place().parent_path() / folder;
  std::error_code none;
  if (fs::is_directory(fs::symlink_status(path, none))) fs::remove_all(path, none);
}

}  // namespace linden
