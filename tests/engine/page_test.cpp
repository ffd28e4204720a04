#include "engine/view/page.hpp"

#include <zlib.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "engine/queries/link_motion.hpp"
#include "engine/simulation.hpp"
#include "engine/view/animation_recorder.hpp"
#include "engine/view/base64.hpp"
#include "engine/view/curves.hpp"
#include "engine/view/page_template.hpp"
#include "models/build/coupled_model.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"

namespace linden::page_test {
namespace {

/// The data of a page, read by the specification alone.
class PageData {
 public:
  explicit PageData(const std::string& page) {
    header = nlohmann::json::parse(element(page, "linden-header"));
    const std::string packed = from_base64(element(page, "linden-data"));
    z_stream stream{};
    REQUIRE(inflateInit(&stream) == Z_OK);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    stream.avail_in = static_cast<uInt>(packed.size());
    int status = Z_OK;
    while (status == Z_OK) {
      const std::size_t before = bytes_.size();
      bytes_.resize(before + (1 << 16));
      stream.next_out = reinterpret_cast<Bytef*>(bytes_.data() + before);
      stream.avail_out = 1 << 16;
      status = inflate(&stream, Z_NO_FLUSH);
      bytes_.resize(bytes_.size() - stream.avail_out);
    }
    inflateEnd(&stream);
    REQUIRE(status == Z_STREAM_END);
  }

  template <class T>
  std::vector<T> take(std::size_t count) {
    at_ = (at_ + 3) / 4 * 4;
    REQUIRE(at_ + count * sizeof(T) <= bytes_.size());
    std::vector<T> numbers(count);
    std::memcpy(numbers.data(), bytes_.data() + at_, count * sizeof(T));
    at_ += count * sizeof(T);
    return numbers;
  }
  bool at_end() const { return at_ == bytes_.size(); }

  nlohmann::json header;

 private:
  static std::string element(const std::string& page, const std::string& id) {
    const std::size_t tag = page.find("id=\"" + id + "\">");
    REQUIRE(tag != page.npos);
    const std::size_t begin = page.find('>', tag) + 1;
    return page.substr(begin, page.find("</script>", begin) - begin);
  }

  std::string bytes_;
  std::size_t at_ = 0;
};

/// Undoes differences along the frames of arrays [frames, each].
template <class T>
std::vector<T> summed(std::vector<T> numbers, std::size_t each) {
  for (std::size_t k = each; k < numbers.size(); ++k) numbers[k] = static_cast<T>(numbers[k] + numbers[k - each]);
  return numbers;
}

Animation random_animation(std::size_t frames, std::int64_t instances, double extent) {
  Animation animation;
  animation.title = "random";
  animation.bodies = {"a", "b", "c"};
  animation.joints = {"a_joint", "b_joint", "c_joint"};
  animation.parents = {-1, 0, 1};
  animation.instances = instances;
  std::mt19937_64 random(5);
  std::normal_distribution<double> number;
  for (std::size_t frame = 0; frame < frames; ++frame) {
    animation.times.push_back(2 + 0.1 * static_cast<double>(frame));
    for (std::int64_t k = 0; k < 3 * instances; ++k) {
      double q[4], square = 0;
      for (double& part : q) {
        part = number(random);
        square += part * part;
      }
      for (const double part : q) animation.poses.push_back(static_cast<float>(part / std::sqrt(square)));
      for (int axis = 0; axis < 3; ++axis) animation.poses.push_back(static_cast<float>(extent * number(random)));
    }
    animation.forces.push_back({});
  }
  return animation;
}

TEST_CASE("cables, springs and rods are lines between places on bodies, in the frames that poses have") {
  if (page_template().empty()) return;
  CouplingSpec cable, rod;
  cable.name = "cable";
  cable.kind = CouplingKind::cable;
  cable.through = {{"world", {1, 2, 3}}, {"link1", {0.1, 0.2, 0.3}}, {"link2", {0.5, 0, 0}}};
  rod.name = "rod";
  rod.kind = CouplingKind::rod;
  rod.link_b = "link2";
  rod.frame_a.translation() = Eigen::Vector3d(0, 0, 1);
  const Model model = coupled(generate("chain:2"), {cable, rod});
  AnimationRecorder recorder(model, {}, "lines", 1);
  const std::vector<double> neutral = model.neutral();
  recorder.add(0, neutral);
  const nlohmann::json lines = PageData(page_of(recorder.animation())).header.at("lines");
  REQUIRE(lines.size() == 2);
  CHECK(lines[0].at("name") == "cable");
  const auto slot = [&](const char* link) { return model.names.link.at(link).slot; };
  const auto check = [&](const nlohmann::json& point, Index on, std::array<double, 3> at) {
    CHECK(point[0] == on);
    for (std::size_t k = 0; k < 3; ++k) CHECK(point[k + 1].get<double>() == Approx(at[k]).margin(1e-6));
  };
  REQUIRE(lines[0].at("points").size() == 3);
  check(lines[0].at("points")[0], 0, {1, 2, 3});
  check(lines[0].at("points")[1], slot("link1"), {0.1, 0.2, 0.3});
  check(lines[0].at("points")[2], slot("link2"), {0.5, 0, 0});
  REQUIRE(lines[1].at("points").size() == 2);
  check(lines[1].at("points")[0], 0, {0, 0, 1});
  check(lines[1].at("points")[1], slot("link2"), {0, 0, 0});
}

TEST_CASE("a page gives back all poses within the error that it states") {
  if (page_template().empty()) return;  // built without
  for (const double extent : {0.01, 1.0, 3000.0}) {
    const Animation animation = random_animation(7, 2, extent);
    PageData data(page_of(animation));
    const auto& header = data.header;
    const std::size_t F = header.at("frames"), I = header.at("instances"), B = header.at("bodies").size();
    REQUIRE(F == 7);
    REQUIRE(I == 2);
    REQUIRE(B == 3);
    CHECK(data.take<float>(F)[1] == Approx(0.1));
    const std::vector<double> grid = header.at("grid");
    const auto bounds = data.take<float>(6 * I);
    for (std::size_t n = 0; n < F * I * B; ++n) {
      for (std::size_t k = 0; k < 3; ++k) {
        const float* const of = &bounds[6 * (n / B % I) + k];
        CHECK(animation.poses[7 * n + 4 + k] >= of[0]);
        CHECK(animation.poses[7 * n + 4 + k] <= (of[0] + of[3]) * (1 + 1e-6F) + 1e-6F * of[3]);
      }
    }
    const std::size_t each = I * B;
    std::vector<std::uint32_t> places[3];
    std::vector<std::uint16_t> rotations[3];
    const auto low = data.take<std::uint16_t>(3 * F * each), high = data.take<std::uint16_t>(3 * F * each);
    const auto turned = data.take<std::uint16_t>(3 * F * each);
    const auto largest = data.take<std::uint8_t>(F * each);
    for (std::size_t k = 0; k < 3; ++k) {
      std::vector<std::uint32_t> both(F * each);
      for (std::size_t n = 0; n < both.size(); ++n) both[n] = low[k * F * each + n] | static_cast<std::uint32_t>(high[k * F * each + n]) << 16;
      places[k] = summed(both, each);
      rotations[k] = summed(std::vector<std::uint16_t>(turned.begin() + static_cast<std::ptrdiff_t>(k * F * each),
                                                       turned.begin() + static_cast<std::ptrdiff_t>((k + 1) * F * each)), each);
    }
    double worst_place = 0, worst_angle = 0;
    for (std::size_t n = 0; n < F * each; ++n) {
      double square = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double off = grid[k] + grid[3] * places[k][n] - animation.poses[7 * n + 4 + k];
        square += off * off;
      }
      worst_place = std::max(worst_place, std::sqrt(square));
      double parts[3], rest = 1;
      for (std::size_t k = 0; k < 3; ++k) {
        parts[k] = (2.0 * rotations[k][n] / 65535 - 1) / std::numbers::sqrt2;
        rest -= parts[k] * parts[k];
      }
      std::size_t from = 0;
      double q[4];
      for (std::size_t k = 0; k < 4; ++k) q[k] = k == largest[n] ? std::sqrt(rest) : parts[from++];
      double near = 0, far = 0;  // q and -q are one rotation
      for (std::size_t k = 0; k < 4; ++k) {
        near += std::pow(q[k] - animation.poses[7 * n + k], 2);
        far += std::pow(q[k] + animation.poses[7 * n + k], 2);
      }
      worst_angle = std::max(worst_angle, 4 * std::asin(std::sqrt(std::min(near, far)) / 2));
    }
    INFO("extent " << extent << " m, off by " << worst_place << " m, " << worst_angle << " rad");
    CHECK(worst_place <= header.at("error").at("place").get<double>() * (1 + 1e-6) + 1e-7 * extent);
    CHECK(header.at("error").at("place").get<double>() < 1e-4);
    CHECK(worst_angle <= header.at("error").at("angle").get<double>());
    CHECK(worst_angle > 0);
    data.take<std::uint32_t>(F);
    CHECK(data.at_end());
  }
}

TEST_CASE("curves and forces of a page are those of the animation") {
  if (page_template().empty()) return;
  Animation animation = random_animation(3, 1, 1);
  animation.curves = {{"energy", "total", "J", -1, 0, {1, 2, 4}},
                      {"position", "still", "rad", 2, 0, {7, 7, 7}},
                      {"position", "gap", "rad", 2, 0, {0, NAN, 1}}};
  animation.forces = {{}, {{0, 2, {1, 2, 3}, {4, 5, 6}}}, {}};
  PageData data(page_of(animation));
  data.take<float>(3);
  data.take<float>(6);
  for (int k = 0; k < 3; ++k) data.take<std::uint16_t>(3 * 9);
  data.take<std::uint8_t>(9);
  const auto packed = data.take<std::uint16_t>(9);
  const auto value = [&](std::size_t curve, std::size_t frame) {
    std::uint16_t sum = 0;
    for (std::size_t k = 0; k <= frame; ++k) sum = static_cast<std::uint16_t>(sum + packed[3 * curve + k]);
    const auto& about = data.header.at("curves").at(curve);
    const double least = about.at("least"), most = about.at("most");
    return sum == 0 ? NAN : least + (sum - 1) / 65534.0 * (most - least);
  };
  CHECK(value(0, 0) == 1);
  CHECK(value(0, 1) == Approx(2).epsilon(1e-4));
  CHECK(value(0, 2) == 4);
  CHECK(value(1, 2) == 7);
  CHECK(std::isnan(value(2, 1)));
  CHECK(value(2, 2) == 1);
  CHECK(data.header.at("curves").at(1).at("body") == 1);
  CHECK(data.header.at("curves").at(0).at("body") == -1);
  CHECK(data.take<std::uint32_t>(3) == std::vector<std::uint32_t>{0, 1, 0});
  CHECK(data.take<float>(8) == std::vector<float>{0, 1, 1, 2, 3, 4, 5, 6});
  CHECK(data.at_end());
}

TEST_CASE("no name of a model becomes part of the page") {
  if (page_template().empty()) return;
  Animation animation = random_animation(1, 1, 1);
  animation.title = "</script><script>alert(1)</script>";
  animation.bodies[0] = "<img src=x onerror=alert(1)> \xff";
  const std::string page = page_of(animation);
  CHECK(page.find("alert(1)</script>") == page.npos);
  CHECK(page.find("<img src=x") == page.npos);
  CHECK(PageData(page).header.at("title") == animation.title);
}

TEST_CASE("a motion without a frame is refused") {
  if (page_template().empty()) return;
  CHECK_THROWS_WITH(page_of(random_animation(0, 1, 1)), Catch::Contains("without a frame"));
}

TEST_CASE("base64 is RFC 4648's") {
  const std::pair<const char*, const char*> vectors[] = {{"", ""},         {"f", "Zg=="},         {"fo", "Zm8="},        {"foo", "Zm9v"},
                                                         {"foob", "Zm9vYg=="}, {"fooba", "Zm9vYmE="}, {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : vectors) {
    CHECK(base64(bytes) == text);
    CHECK(from_base64(text) == bytes);
  }
  CHECK_THROWS(from_base64("Zg="));
  CHECK_THROWS(from_base64("Z!=="));
}

TEST_CASE("an animation holds the poses that a simulation has, and its curves the numbers") {
  const Model model = load_urdf(LINDEN_MODELS_DIR "/humanoid.urdf", Base::floating);
  Simulation simulation(model);
  AnimationRecorder recorder(model, {}, "humanoid", 1);
  recorder.add_curves(position_curves(model, 0));
  const auto look = [&] { recorder.add(simulation.time(), simulation.positions(), simulation.positions()); };
  look();
  simulation.run(50);
  look();
  const Animation& animation = recorder.animation();
  REQUIRE(animation.frames() == 2);
  REQUIRE(animation.poses.size() == 2 * 7 * animation.bodies.size());
  for (std::size_t b = 0; b < animation.bodies.size(); ++b) {
    const Kinematics now(model, simulation.positions());
    const Pose pose = link_pose(now, place_of(model, animation.bodies[b]));
    const float* const seen = &animation.poses[animation.pose_at(1, 0, b)];
    for (std::size_t k = 0; k < 3; ++k) CHECK(seen[4 + k] == Approx(pose.shift[k]).margin(1e-6));
    const double x = seen[0], y = seen[1], w = seen[3], z = seen[2];
    CHECK(1 - 2 * (y * y + z * z) == Approx(pose.rotation[0]).margin(1e-6));
    CHECK(2 * (x * y - z * w) == Approx(pose.rotation[1]).margin(1e-6));
    CHECK(2 * (x * z + y * w) == Approx(pose.rotation[2]).margin(1e-6));
  }
  for (std::size_t row = 0; row < simulation.positions().size(); ++row) {
    CHECK(animation.curves[row].values[1] == static_cast<float>(simulation.positions()[row]));
    CHECK(animation.curves[row].name == model.names.position[row]);
  }
}

TEST_CASE("positions that are not finite are refused by name, instance and time") {
  const Model model = chain(3);
  AnimationRecorder recorder(model, {}, "chain", 2);
  const std::vector<double> good(6, 0.1);
  recorder.add(0, good);
  std::vector<double> bad = good;
  bad[4] = NAN;
  CHECK_THROWS_WITH(recorder.add(0.5, bad), Catch::Contains(model.names.position[1]) && Catch::Contains("instance 1 at 0.5 s"));
}

TEST_CASE("frames are those that were asked for, or as many as can be shown, which is said") {
  const FrameStride usual = frame_stride(10'000, 1e-3, 60, 35);
  CHECK(usual.steps == 17);
  CHECK(usual.note.empty());
  CHECK(frame_stride(10'000, 0.1, 60, 35).steps == 1);
  const FrameStride many = frame_stride(3'600'000, 1e-3, 60, 35);
  CHECK(many.steps == 21);
  CHECK_THAT(many.note, Catch::Contains("0.021 s"));
  CHECK(frame_stride(10, 1e-3, 60, 10'000'000).steps >= 10);
}

}  // namespace
}  // namespace linden::page_test
