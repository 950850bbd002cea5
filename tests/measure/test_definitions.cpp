// metrics.json, its definitions and docs/metrics.md say the same.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "measure/report_files.hpp"
#include "tests/measure/defined.hpp"
#include "tests/measure/vessels.hpp"

namespace vstent::measure {
namespace {

using tests::TestVessel;

TEST(Definitions, CoverEveryFigureAndEveryFigureIsThereOrSaysWhyNot) {
  const TestVessel before = tests::lathe(40, 40, 41, [](double) { return 3.0; });
  const TestVessel after = tests::lathe(40, 40, 41, [](double) { return 4.0; });
  const TestVessel other = tests::lathe(40, 44, 43, [](double) { return 4.0; });
  const StentBody stent = tests::straight_stent(12, 28, 4, 0.3);
  for (const StentBody* known : {static_cast<const StentBody*>(nullptr), &stent}) {
    for (const vessels::Surface* surface : {&after.surface, &other.surface}) {
      const Metrics m = measure({before.surface, *surface, before.centerline, known}).metrics;
      const auto json = to_json(m);
      tests::expect_absences_stated(tests::defined_in(json));
      // Whatever is null is explained, by itself or with its group.
      std::vector<std::string> pointers;
      tests::scalars_of(json, "", pointers);
      for (const std::string& pointer : pointers) {
        if (pointer.starts_with("/stations") || pointer.starts_with("/branches") ||
            !json.at(nlohmann::ordered_json::json_pointer(pointer)).is_null())
          continue;
        const std::string group = pointer.substr(0, pointer.find('/', 1));
        EXPECT_TRUE(json["unmeasured"].contains(pointer) || json["unmeasured"].contains(group))
            << pointer;
      }
    }
  }
}

TEST(Definitions, AreUniqueAndWhole) {
  std::set<std::string_view> keys;
  for (const Definition& d : definitions()) {
    EXPECT_TRUE(keys.insert(d.key).second) << d.key;
    EXPECT_FALSE(d.label.empty() || d.meaning.empty()) << d.key;
    EXPECT_TRUE(d.meaning.ends_with(".")) << d.key;
    EXPECT_EQ(find_definition(d.key), &d) << d.key;
    // A unit in the key is the unit stated.
    for (const auto& [suffix, unit] : {std::pair<std::string_view, std::string_view>{"_mm", "mm"},
                                       {"_mm2", "mm2"},
                                       {"_mm3", "mm3"},
                                       {"_percent", "%"},
                                       {"_deg", "deg"},
                                       {"_per_mm", "1/mm"}}) {
      if (d.key.ends_with("_over_90_deg")) continue;  // a number of triangles
      if (d.key.ends_with(suffix) && !(suffix == "_mm" && d.key.ends_with("_per_mm"))) {
        EXPECT_EQ(d.unit, unit) << d.key;
      }
    }
  }
  EXPECT_EQ(find_definition("/lumen/no_such_figure"), nullptr);
  EXPECT_EQ(find_definition("/lumen"), nullptr);
}

TEST(Definitions, AreThoseOfTheDocumentation) {
  std::ifstream file(VSTENT_DOCS "/metrics.md");
  const std::string page{std::istreambuf_iterator<char>(file), {}};
  EXPECT_NE(page.find(definitions_markdown()), std::string::npos)
      << "docs/metrics.md: put the output of `vstent measure --definitions` in place of its table";
}

TEST(TextTable, ShowsWhatIsKnownByItsLabelAndWhyTheRestIsNot) {
  const TestVessel vessel = tests::lathe(40, 40, 41, [](double) { return 3.0; });
  const auto json = to_json(measure({vessel.surface, vessel.surface, vessel.centerline}).metrics);
  const std::string table = text_table(json);
  EXPECT_NE(table.find("Acute gain                                            0 mm\n"),
            std::string::npos)
      << table;
  EXPECT_EQ(table.find("Largest gap"), std::string::npos);
  EXPECT_NE(table.find("/apposition: no stent is given"), std::string::npos) << table;
}

}  // namespace
}  // namespace vstent::measure
