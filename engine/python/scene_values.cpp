#include "engine/python/scene_values.hpp"

#include <fmt/format.h>
#include <nanobind/stl/string.h>

#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace nb = nanobind;

namespace linden::python {
namespace {

std::shared_ptr<YamlNode> node_of(nb::handle value, const std::string& path, int levels);

std::shared_ptr<YamlNode> map_of(nb::dict values, const std::string& path, int levels) {
  auto node = std::make_shared<YamlNode>();
  node->line = 0;
  node->kind = YamlNode::Kind::map;
  for (const auto& [key, value] : values) {
    if (!nb::isinstance<nb::str>(key)) {
      throw InputError(fmt::format("{}{}the key {} is no text; expected the name of a setting, a joint or a link", path,
                                   path.empty() ? "" : ": ", nb::repr(key).c_str()));
    }
    std::string name = nb::cast<std::string>(key);
    node->items.push_back(node_of(value, path.empty() ? name : fmt::format("{}.{}", path, name), levels + 1));
    node->keys.push_back(std::move(name));
    node->key_lines.push_back(0);
  }
  return node;
}

std::shared_ptr<YamlNode> list_of(nb::handle values, const std::string& path, int levels) {
  auto node = std::make_shared<YamlNode>();
  node->line = 0;
  node->kind = YamlNode::Kind::list;
  for (const nb::handle value : values) node->items.push_back(node_of(value, fmt::format("{}[{}]", path, node->items.size()), levels + 1));
  return node;
}

std::shared_ptr<YamlNode> text_node(std::string text) {
  auto node = std::make_shared<YamlNode>();
  node->line = 0;
  node->kind = YamlNode::Kind::text;
  node->text = std::move(text);
  return node;
}

std::shared_ptr<YamlNode> node_of(nb::handle value, const std::string& path, int levels) {
  if (levels > SceneYaml::kMostLevels) throw InputError(fmt::format("{}: more than {} levels deep", path, SceneYaml::kMostLevels));
  if (nb::isinstance<nb::dict>(value)) return map_of(nb::borrow<nb::dict>(value), path, levels);
  if (nb::isinstance<nb::str>(value)) return text_node(nb::cast<std::string>(value));
  if (nb::isinstance<nb::list>(value) || nb::isinstance<nb::tuple>(value)) return list_of(value, path, levels);
  if (value.is_none()) {
    auto nothing = std::make_shared<YamlNode>();
    nothing->line = 0;
    return nothing;
  }
  if (nb::hasattr(value, "tolist")) return node_of(value.attr("tolist")(), path, levels);  // arrays and numbers of NumPy
  if (PyFloat_Check(value.ptr())) return text_node(text_of(nb::cast<double>(value)));
  if (PyLong_Check(value.ptr()) && !PyBool_Check(value.ptr())) return text_node(nb::str(value).c_str());
  if (nb::hasattr(value, "__fspath__")) return text_node(nb::cast<std::string>(value.attr("__fspath__")()));
  throw InputError(
      fmt::format("{} is of type {}; expected a number, text, a list or a dict of these", path, nb::type_name(value.type()).c_str()));
}

}  // namespace

std::shared_ptr<const YamlNode> scene_values(nb::handle value) {
  if (!nb::isinstance<nb::dict>(value)) {
    throw InputError(fmt::format("a scene's settings are of type {}; expected a dict of them", nb::type_name(value.type()).c_str()));
  }
  return node_of(value, "", 0);
}

}  // namespace linden::python
