#include <gtest/gtest.h>

#include "vessels/error.hpp"
#include "vessels/units.hpp"

namespace vstent::vessels {
namespace {

TEST(Units, NamesRoundTrip) {
  for (const LengthUnit unit : {LengthUnit::mm, LengthUnit::cm, LengthUnit::m})
    EXPECT_EQ(parse_unit(name(unit)), unit);
  for (const char* wrong : {"", "MM", "inch", "mm ", "km"})
    EXPECT_THROW(parse_unit(wrong), Error) << wrong;
}

TEST(Units, LengthsAreMillimetres) {
  EXPECT_DOUBLE_EQ(parse_length("30mm", LengthUnit::m, "length"), 30);
  EXPECT_DOUBLE_EQ(parse_length(" 1.6 cm ", LengthUnit::m, "length"), 16);
  EXPECT_DOUBLE_EQ(parse_length("0.03m", LengthUnit::mm, "length"), 30);
  EXPECT_DOUBLE_EQ(parse_length("11", LengthUnit::mm, "length"), 11);
  EXPECT_DOUBLE_EQ(parse_length("1.1", LengthUnit::cm, "length"), 11);
  EXPECT_DOUBLE_EQ(parse_length("+2e1mm", LengthUnit::cm, "length"), 20);
  EXPECT_DOUBLE_EQ(parse_length("-3", LengthUnit::mm, "offset"), -3);
}

TEST(Units, AnythingElseNamesItsKey) {
  for (const char* wrong : {"", "mm", "abc", "1,5mm", "5 in", "5mmm", "nan", "inf", "1e999",
                            "1e308m", "5 mm mm", "+-3"}) {
    try {
      parse_length(wrong, LengthUnit::mm, "/stent/length");
      ADD_FAILURE() << wrong;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::usage);
      EXPECT_TRUE(std::string(error.what()).starts_with("/stent/length: ")) << error.what();
    }
  }
}

}  // namespace
}  // namespace vstent::vessels
