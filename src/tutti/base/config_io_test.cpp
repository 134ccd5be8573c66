// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/config_io.hpp"

#include <gtest/gtest.h>
// gtest first
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>

namespace tutti {
namespace config_io_test {

struct RobotSettings {
  std::string name = "alpha";
  double voxel_m = 0.3;
  std::vector<double> offset_m{1.0, 2.0};
  template <class V>
  void describe(V& v) {
    v.field("name", name, one_of({"alpha", "bravo"}), "Who it is.");
    v.field("voxel_m", voxel_m, greater_than(0.0), "Edge of a voxel.");
    v.field("offset_m", offset_m, any(), "Start.");
  }
  friend bool operator==(const RobotSettings&, const RobotSettings&) = default;
};

struct Settings {
  bool enable_feedback = true;
  int min_inliers = 30;
  std::uint64_t seed = 1;
  std::optional<double> limit_s;
  RobotSettings base;
  std::vector<RobotSettings> robots;
  template <class V>
  void describe(V& v) {
    v.field("enable_feedback", enable_feedback);
    v.field("min_inliers", min_inliers, at_least(3), "After verification.");
    v.field("seed", seed);
    v.field("limit_s", limit_s, between(0.0, 10.0));
    v.field("base", base);
    v.field("robots", robots);
  }
  friend bool operator==(const Settings&, const Settings&) = default;
};

ConfigNode parse(const std::string& text) {
  auto node = parse_yaml(text, "x.yaml");
  EXPECT_TRUE(node) << (node ? "" : node.error().message);
  return node.value_or(ConfigNode{});
}

std::string problems(const std::string& text) {
  Settings settings;
  const Status status = load_config(parse(text), settings, "x.yaml");
  if (status) return "";
  EXPECT_EQ(status.error().code, ErrorCode::configuration);
  return status.error().message;
}

std::string parse_error(const std::string& text) {
  const auto node = parse_yaml(text, "x.yaml");
  if (node) return "";
  EXPECT_EQ(node.error().code, ErrorCode::parse);
  return node.error().message;
}

TEST(Config, FillsWhatIsGivenAndKeepsDefaults) {
  Settings settings;
  const auto status = load_config(parse("enable_feedback: false\n"
                                        "seed: 18446744073709551615\n"
                                        "limit_s: 2.5\n"
                                        "base: {voxel_m: 1e-1, offset_m: [.inf, -3]}\n"
                                        "robots:\n"
                                        "  - name: bravo\n"
                                        "  - {}\n"),
                                  settings, "x.yaml");
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_FALSE(settings.enable_feedback);
  EXPECT_EQ(settings.min_inliers, 30);
  EXPECT_EQ(settings.seed, std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(settings.limit_s, 2.5);
  EXPECT_EQ(settings.base.voxel_m, 0.1);
  EXPECT_EQ(settings.base.offset_m, (std::vector<double>{std::numeric_limits<double>::infinity(), -3.0}));
  ASSERT_EQ(settings.robots.size(), 2U);
  EXPECT_EQ(settings.robots[0].name, "bravo");
  EXPECT_EQ(settings.robots[1], RobotSettings{});
}

TEST(Config, EmptyDocumentMeansAllDefaults) {
  for (const char* text : {"", "# nothing\n", "~\n", "{}\n", "seed:\nbase: ~\n"}) {
    Settings settings;
    EXPECT_TRUE(load_config(parse(text), settings, "x.yaml")) << text;
    EXPECT_EQ(settings, Settings{}) << text;
  }
}

TEST(Config, ReportsEveryProblemWithLinePathValueAndBound) {
  EXPECT_EQ(problems("robots:\n"
                     "  - voxel_m: -1\n"
                     "    nmae: bravo\n"
                     "min_inliers: 2.5\n"
                     "seed: -1\n"
                     "limit_s: 11\n"
                     "base:\n"
                     "  name: charlie\n"
                     "  offset_m: 3\n"
                     "enable_feedback: [true]\n"
                     "completely_different_words: 3\n"),
            "x.yaml:10: enable_feedback: expected true or false, got a list\n"
            "x.yaml:4: min_inliers: expected an integer, got '2.5'\n"
            "x.yaml:5: seed: expected a non-negative integer, got '-1'\n"
            "x.yaml:6: limit_s: is 11, must be in [0, 10]\n"
            "x.yaml:8: base.name: is charlie, must be one of alpha, bravo\n"
            "x.yaml:9: base.offset_m: expected a list\n"
            "x.yaml:2: robots.0.voxel_m: is -1, must be > 0\n"
            "x.yaml:11: completely_different_words: unknown key, known here: enable_feedback, min_inliers, seed, "
            "limit_s, base, robots\n"
            "x.yaml:3: robots.0.nmae: unknown key, did you mean 'name'?");
}

struct RenamedSettings {
  double distance_m = 1.0;
  template <class V>
  void describe(V& v) {
    v.field("distance_m", distance_m, formerly("way_m", greater_than(0.0)));
  }
};

TEST(Config, AFormerNameIsRead) {
  RenamedSettings settings;
  ASSERT_TRUE(load_config(parse("way_m: 2"), settings, "x.yaml"));
  EXPECT_EQ(settings.distance_m, 2.0);
  const auto problem_of = [&](const std::string& text) {
    const Status status = load_config(parse(text), settings, "x.yaml");
    return status ? "" : status.error().message;
  };
  EXPECT_EQ(problem_of("way_m: -1"), "x.yaml:1: distance_m: is -1, must be > 0");
  EXPECT_EQ(problem_of("distance_m: 2\nway_m: 3"),
            "x.yaml:2: distance_m: given twice, also by its former name 'way_m'");
  EXPECT_EQ(problem_of("weg_m: 2"), "x.yaml:1: weg_m: unknown key, known here: distance_m");
}

TEST(Config, TheCommandLineCountsByEitherName) {
  const auto read = [](const std::string& text, const std::string& assignment) {
    ConfigNode node = parse(text);
    EXPECT_TRUE(apply_override(node, assignment));
    RenamedSettings settings;
    const Status status = load_config(node, settings, "x.yaml");
    EXPECT_TRUE(status) << (status ? "" : status.error().message);
    return settings.distance_m;
  };
  EXPECT_EQ(read("distance_m: 2", "way_m=3"), 3.0);
  EXPECT_EQ(read("way_m: 2", "distance_m=3"), 3.0);
  EXPECT_EQ(read("way_m: 2", "way_m=3"), 3.0);
}

TEST(Config, SaysWhatStandsThereInstead) {
  EXPECT_EQ(problems("base: {offset_m: [~, {}]}"),
            "x.yaml:1: base.offset_m.0: expected a number, got nothing\n"
            "x.yaml:1: base.offset_m.1: expected a number, got a map");
  EXPECT_EQ(problems("[1, 2]"), "x.yaml:1: expected a map of settings");
  EXPECT_EQ(problems("base"), "x.yaml:1: expected a map of settings");
}

TEST(Config, RefusesNotANumber) {
  for (const char* text : {"nan", ".nan", "-nan", "NaN", "1.0x", "", "0x10", "1 2", "--1", "+-1", "1e999"})
    EXPECT_NE(problems(fmt::format("base: {{voxel_m: '{}'}}", text)), "") << text;
}

TEST(Config, RefusesBrokenYaml) {
  EXPECT_EQ(parse_error("a: 1\nb: 2\na: 3\n"), "x.yaml:3: key 'a' appears twice");
  EXPECT_EQ(parse_error("a:\n  b: 1\n  b: 1\n"), "x.yaml:3: key 'b' appears twice");
  EXPECT_TRUE(parse_error("a: 1\nb: [1, 2\n").starts_with("x.yaml:3: ")) << parse_error("a: 1\nb: [1, 2\n");
  EXPECT_NE(parse_error("a: *nowhere\n"), "");
  EXPECT_NE(parse_error("---\na: 1\n---\na: 2\n"), "");
  EXPECT_EQ(parse_error(",a: 1"), "x.yaml: several YAML documents, expected one");  // yaml-cpp would find ever more
  EXPECT_NE(parse_error("? [a, b]\n: 1\n"), "");
  EXPECT_NE(parse_error("\ta: 1\n"), "");
}

TEST(Config, RefusesDocumentsThatUnfoldWithoutEnd) {
  EXPECT_NE(parse_error("&a [*a]\n"), "");
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 12; ++i) {
    bomb += fmt::format("a{}: &a{} [", i, i);
    for (int k = 0; k < 9; ++k) bomb += fmt::format("{}*a{}", k == 0 ? "" : ", ", i - 1);
    bomb += "]\n";
  }
  EXPECT_NE(parse_error(bomb), "");
  EXPECT_NE(parse_error(std::string(10000, '[')), "");
  EXPECT_NE(parse_error(std::string(10000, '{')), "");
}

RC_GTEST_PROP(Config, AnyBytesParseOrFailWithAMessage, (const std::string& text)) {
  const auto node = parse_yaml(text, "x.yaml");
  if (!node) RC_ASSERT(node.error().message.starts_with("x.yaml:"));
}

TEST(Config, MissingFileAndFolderAreErrors) {
  const auto missing = load_yaml("no/such/file.yaml");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::io);
  EXPECT_NE(missing.error().message.find("no/such/file.yaml"), std::string::npos);
  EXPECT_FALSE(load_yaml(std::filesystem::temp_directory_path().string()));
}

TEST(Config, LoadsFiles) {
  const auto path = (std::filesystem::temp_directory_path() / "tutti_config_test.yaml").string();
  std::ofstream(path) << "min_inliers: 4\n";
  const auto node = load_yaml(path);
  ASSERT_TRUE(node) << node.error().message;
  ASSERT_NE(node->find("min_inliers"), nullptr);
  EXPECT_EQ(node->find("min_inliers")->scalar, "4");
  std::ofstream(path, std::ios::trunc).close();
  EXPECT_TRUE(load_yaml(path));
  std::filesystem::remove(path);
}

TEST(Config, OverridesReachEverything) {
  ConfigNode root = parse("robots: [{name: alpha}, {name: bravo}]\n");
  for (const char* assignment : {"robots.bravo.voxel_m=0.5", "robots.alpha.voxel_m=0.25", "base.offset_m=[4, 5]",
                                 "min_inliers=7", "enable_feedback=false", "base.name=bravo"})
    ASSERT_TRUE(apply_override(root, assignment)) << assignment;
  Settings settings;
  const auto status = load_config(root, settings, "x.yaml");
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_EQ(settings.robots[0].voxel_m, 0.25);
  EXPECT_EQ(settings.robots[1].voxel_m, 0.5);
  EXPECT_EQ(settings.base.offset_m, (std::vector<double>{4.0, 5.0}));
  EXPECT_EQ(settings.min_inliers, 7);
  EXPECT_FALSE(settings.enable_feedback);
  EXPECT_EQ(settings.base.name, "bravo");
}

/// `tutti settings` lists robots[].voxel_m: with a number in its brackets, that is a key.
TEST(Config, ElementsOfListsMayBeNamedInBrackets) {
  for (const auto& [bracketed, dotted] :
       std::vector<std::pair<std::string, std::string>>{{"robots[1].voxel_m=0.5", "robots.1.voxel_m=0.5"},
                                                        {"robots[0].offset_m[2]=7", "robots.0.offset_m.2=7"},
                                                        {"robots[1]={name: alpha}", "robots.1={name: alpha}"}}) {
    const ConfigNode before = parse("robots: [{name: alpha, offset_m: [1, 2, 3]}, {name: bravo}]\n");
    ConfigNode a = before, b = before;
    ASSERT_TRUE(apply_override(a, bracketed)) << apply_override(a, bracketed).error().message;
    ASSERT_TRUE(apply_override(b, dotted)) << dotted;
    EXPECT_EQ(to_yaml(a), to_yaml(b));
    EXPECT_NE(to_yaml(a), to_yaml(before)) << bracketed;
  }
}

TEST(Config, BadBracketsSayWhatIsExpected) {
  const auto message = [](const std::string& assignment) {
    ConfigNode root = parse("robots: [{name: alpha}]\nseed: 3\n");
    const std::string before = to_yaml(root);
    const auto status = apply_override(root, assignment);
    EXPECT_EQ(to_yaml(root), before) << assignment;
    return status ? "no error" : status.error().message;
  };
  for (const char* key : {"robots[]", "robots[x]", "robots[0", "robots]0[", "robots[-1]", "robots[0]x", "robots[0]]"})
    EXPECT_EQ(message(fmt::format("{}.name=x", key)),
              fmt::format("--set {}.name=x: '{}' names no element, expected its number: robots[0]", key, key));
  EXPECT_EQ(message("[0].name=x"), "--set [0].name=x: empty step in the key");
  EXPECT_EQ(message("robots[1].name=x"), "--set robots[1].name=x: '1' is no element of the list, which has 1 (alpha)");
  EXPECT_EQ(message("seed[0]=x"), "--set seed[0]=x: [0] stands behind '3', expected a list that the file has");
  EXPECT_EQ(message("robot[0]=x"), "--set robot[0]=x: [0] stands behind nothing, expected a list that the file has");
}

TEST(Config, BadOverridesSayWhyAndChangeNothing) {
  ConfigNode root = parse("robots: [{name: alpha}]\nseed: 3\n");
  const std::string before = to_yaml(root);
  for (const char* assignment : {"seed", "=3", "robots.1.name=x", "robots.x=1", "seed.deep=1", "new.=1", ".a=1",
                                 "a..b=1", "seed=[1", "robots.-1.name=x"}) {
    const auto status = apply_override(root, assignment);
    ASSERT_FALSE(status) << assignment;
    EXPECT_NE(status.error().message.find(assignment), std::string::npos) << status.error().message;
    EXPECT_EQ(to_yaml(root), before) << assignment;
  }
  ASSERT_TRUE(apply_override(root, "min_inlier=1"));  // found out when loading, without a line
  Settings settings;
  EXPECT_EQ(load_config(root, settings, "x.yaml").error().message,
            "x.yaml: min_inlier: unknown key, did you mean 'min_inliers'?");
}

TEST(Config, DumpLoadsBackTheSame) {
  Settings settings;
  settings.limit_s = 0.1;
  settings.seed = 12345678901234567890U;
  settings.robots = {RobotSettings{.name = "bravo", .voxel_m = 1.0 / 3.0, .offset_m = {}}, RobotSettings{}};
  const auto node = parse_yaml(to_yaml(dump_config(settings)), "dump");
  ASSERT_TRUE(node) << node.error().message;
  Settings back;
  const auto status = load_config(*node, back, "dump");
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_EQ(back, settings);
}

bool same_content(const ConfigNode& a, const ConfigNode& b) {
  return a.kind == b.kind && a.scalar == b.scalar &&
         std::ranges::equal(a.list, b.list, [](const auto& x, const auto& y) { return same_content(x, y); }) &&
         std::ranges::equal(a.map, b.map, [](const auto& x, const auto& y) {
           return x.key == y.key && same_content(x.value, y.value);
         });
}

rc::Gen<std::string> yaml_text() {
  return rc::gen::oneOf(
      rc::gen::elementOf(std::vector<std::string>{
          "",    "~",  "null", "true", "- a", "a: b", "#x", "'", "\"", " a ", "1e3", "a\nb", "\n", "|", "é",
          "---", "*a", "&a",   "!t",   "{",   "[",    "%",  "@", "=",  "<<",  "\t",  "a #b", "a:", "?"}),
      rc::gen::container<std::string>(rc::gen::inRange<char>(1, 127)));
}

ConfigNode random_node(int depth) {
  using Kind = ConfigNode::Kind;
  ConfigNode node{.kind = *rc::gen::elementOf(depth > 0 ? std::vector{Kind::scalar, Kind::list, Kind::map, Kind::map}
                                                        : std::vector{Kind::null, Kind::scalar})};
  const int size = *rc::gen::inRange(0, 4);
  if (node.kind == Kind::scalar) node.scalar = *yaml_text();
  if (node.kind == Kind::list)
    for (int i = 0; i < size; ++i) node.list.push_back(random_node(depth - 1));
  if (node.kind == Kind::map)
    for (int i = 0; i < size; ++i) node.map.emplace_back(std::to_string(i) + *yaml_text(), random_node(depth - 1));
  return node;
}

RC_GTEST_PROP(Config, ToYamlRoundTrips, ()) {
  const ConfigNode node = random_node(3);
  const std::string text = to_yaml(node);
  const auto back = parse_yaml(text, "x.yaml");
  if (!back) RC_FAIL(back.error().message + "\n" + text);
  if (!same_content(*back, node)) RC_FAIL(text);
}

RC_GTEST_PROP(Config, PrintedDoublesReadBackBitForBit, (std::uint64_t bits)) {
  const auto value = std::bit_cast<double>(bits);
  RC_PRE(std::isfinite(value));
  double back = 0.0;
  RC_ASSERT(config_internal::parse_scalar(config_internal::print_scalar(value), back));
  RC_ASSERT(std::bit_cast<std::uint64_t>(back) == bits);
}

TEST(Config, PrintsTheShortestText) {
  EXPECT_EQ(config_internal::print_scalar(0.1), "0.1");
  EXPECT_EQ(config_internal::print_scalar(7.0), "7");
  EXPECT_EQ(config_internal::print_scalar(1e-9), "1e-09");
  EXPECT_EQ(config_internal::print_scalar(std::numeric_limits<double>::infinity()), "inf");
}

TEST(Config, NotANumberIsOutsideEveryBound) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Bound& bound : {any(), at_least(0.0), greater_than(0.0), between(0.0, 1.0)})
    EXPECT_NE(config_internal::violation(bound, nan), "");
  EXPECT_EQ(config_internal::violation(greater_than(0.0), 0.0), "must be > 0");
  EXPECT_EQ(config_internal::violation(at_least(0.0), 0.0), "");
  EXPECT_EQ(config_internal::violation(between(0.0, 1.0), 1.0), "");
  EXPECT_EQ(config_internal::violation({.high = 1.0}, 1.5), "must be <= 1");
}

/// The settings that another reader takes from the documents of Settings.
struct More {
  struct Robot {
    double speed_mps = 1.0;
    template <class V>
    void describe(V& v) {
      v.field("speed_mps", speed_mps, greater_than(0.0), "How fast.");
    }
  };
  std::string weather = "dry";
  std::vector<Robot> robots;
  template <class V>
  void describe(V& v) {
    v.field("weather", weather);
    v.field("robots", robots);
  }
};

TEST(ConfigLoader, EveryKeyIsOfOneOfTheReaders) {
  const auto load = [](const std::string& text) {
    const ConfigNode node = parse(text);
    std::pair<Settings, More> read;
    ConfigLoader loader;
    loader.load(node, read.first);
    loader.load(node, read.second);
    const Status status = loader.finish("x.yaml");
    EXPECT_EQ(read.second.weather, "wet");
    return std::pair(read, status ? "" : status.error().message);
  };
  const auto [read, problem] = load("weather: wet\nseed: 5\nrobots: [{name: bravo, speed_mps: 2}, {}]\n");
  EXPECT_EQ(problem, "");
  EXPECT_EQ(read.first.seed, 5U);
  EXPECT_EQ(read.first.robots.at(0).name, "bravo");
  EXPECT_EQ(read.second.robots.at(0).speed_mps, 2.0);
  EXPECT_EQ(read.second.robots.at(1).speed_mps, 1.0);
  EXPECT_EQ(load("weather: wet\nrobots: [{speed_mp: 2}]\nwether: dry").second,
            "x.yaml:3: wether: unknown key, did you mean 'weather'?\n"
            "x.yaml:2: robots.0.speed_mp: unknown key, did you mean 'speed_mps'?");
  EXPECT_EQ(load("weather: wet\nrobots: [{speed_mps: -1, voxel_m: 0}]").second,
            "x.yaml:2: robots.0.voxel_m: is 0, must be > 0\nx.yaml:2: robots.0.speed_mps: is -1, must be > 0");
  EXPECT_EQ(
      load("weather: wet\ncompletely_different_words: 1").second,
      "x.yaml:2: completely_different_words: unknown key, known here: enable_feedback, min_inliers, seed, limit_s, "
      "base, robots, weather");
}

TEST(ConfigLoader, KeysOfAnotherVersionMayBeLeftAlone) {
  const ConfigNode node = parse("seed: 5\nof_tomorrow: {deep: 1}\nbase: {of_yesterday: 2, voxel_m: 0.5}\n");
  Settings settings;
  ConfigLoader loader;
  loader.load(node, settings);
  EXPECT_TRUE(loader.finish_with_unknown("x.yaml").has_value());
  EXPECT_EQ(settings.seed, 5U);
  EXPECT_EQ(settings.base.voxel_m, 0.5);
  EXPECT_FALSE(loader.finish("x.yaml").has_value());
}

TEST(Config, MergedDumpsLoadBackBoth) {
  Settings settings{.seed = 7, .robots = {{.name = "bravo"}, {}}};
  ConfigNode both = dump_config(settings);
  merge_config(both, dump_config(More{.weather = "wet", .robots = {{.speed_mps = 3.0}, {}}}));
  Settings again;
  More more;
  ConfigLoader loader;
  loader.load(both, again);
  loader.load(both, more);
  ASSERT_TRUE(loader.finish("x").has_value());
  EXPECT_EQ(again, settings);
  EXPECT_EQ(more.weather, "wet");
  EXPECT_EQ(more.robots.at(0).speed_mps, 3.0);
}

TEST(Config, DocumentsEveryField) {
  const auto docs = document_config(Settings{});
  std::vector<std::string> paths;
  for (const auto& doc : docs) paths.push_back(doc.path);
  EXPECT_EQ(paths, (std::vector<std::string>{"enable_feedback", "min_inliers", "seed", "limit_s", "base.name",
                                             "base.voxel_m", "base.offset_m", "robots", "robots[].name",
                                             "robots[].voxel_m", "robots[].offset_m"}));
  EXPECT_EQ(docs[1].type, "an integer");
  EXPECT_EQ(docs[1].default_value, "30");
  EXPECT_EQ(docs[1].range, ">= 3");
  EXPECT_EQ(docs[1].help, "After verification.");
}

}  // namespace config_io_test
}  // namespace tutti
