#include "engine/files/h5_output.hpp"

#include <algorithm>
#include <vector>

#include "engine/files/h5_master.hpp"

namespace linden {

Handle H5Output::create() {
  const Handle access = own(H5Pclose, [this] { return disk_.access(); });
  // no chunk waits in memory: what there is room for is asked row by row
  call(H5Pset_cache, access.id(), 0, std::size_t{1}, std::size_t{0}, 1.0);
  return own(H5Fclose, H5Fcreate, kWhole, H5F_ACC_TRUNC, H5P_DEFAULT, access.id());
}

Handle H5Output::creation() const {
  Handle creation = own(H5Pclose, H5Pcreate, H5P_DATASET_CREATE);
  call(H5Pset_obj_track_times, creation.id(), false);
  return creation;
}

Handle H5Output::space(std::span<const hsize_t> sizes, const hsize_t* most) const {
  return own(H5Sclose, H5Screate_simple, static_cast<int>(sizes.size()), sizes.data(), most);
}

Handle H5Output::create(const std::string& name, hid_t type, const Handle& space, const Handle& creation) const {
  return own(H5Dclose, H5Dcreate2, file_.id(), name.c_str(), type, space.id(), H5P_DEFAULT, creation.id(), H5P_DEFAULT);
}

void H5Output::add_words(const std::string& name, std::span<const std::string> words) const {
  std::size_t longest = 1;
  for (const std::string& word : words) longest = std::max(longest, word.size());
  std::string cells;
  for (const std::string& word : words) cells.append(word).append(longest - word.size(), '\0');
  const Handle type = own(H5Tclose, H5Tcopy, H5T_C_S1);
  call(H5Tset_size, type.id(), longest);
  call(H5Tset_cset, type.id(), H5T_CSET_UTF8);
  call(H5Tset_strpad, type.id(), H5T_STR_NULLPAD);
  const hsize_t count = words.size();
  Handle dataset = create(name, type.id(), space({&count, 1}), creation());
  call(H5Dwrite, dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, cells.data());
  finish(dataset);
}

void H5Output::describe(hid_t dataset, std::span<const std::string> names, const std::string& units) const {
  constexpr std::size_t kMostNames = 2000;  // an attribute has 64 KiB
  const Handle type = own(H5Tclose, H5Tcopy, H5T_C_S1);
  call(H5Tset_size, type.id(), H5T_VARIABLE);
  call(H5Tset_cset, type.id(), H5T_CSET_UTF8);
  const auto write = [&](const char* attribute, const Handle& shape, const std::vector<const char*>& words) {
    Handle made = own(H5Aclose, H5Acreate2, dataset, attribute, type.id(), shape.id(), H5P_DEFAULT, H5P_DEFAULT);
    call(H5Awrite, made.id(), type.id(), words.data());
    finish(made);
  };
  write("units", own(H5Sclose, H5Screate, H5S_SCALAR), {units.c_str()});
  if (names.size() > kMostNames) return;
  std::vector<const char*> words;
  for (const std::string& name : names) words.push_back(name.c_str());
  const hsize_t count = words.size();
  write("names", space({&count, 1}), words);
}

void H5Output::publish(const std::string& own_parts, const std::function<void()>& before) {
  finish(file_);
  disk_.close();
  require(true);
  const std::string replaced = parts_folder_of(target());
  before();
  folder_.publish(kWhole);
  if (replaced != own_parts) remove_parts(target(), replaced);
}

void H5Output::require(bool done) const {
  if (disk_.error() != 0) cannot_be_written(target(), disk_.error());
  if (!done) cannot_be_written(target(), first_error());
}

}  // namespace linden
