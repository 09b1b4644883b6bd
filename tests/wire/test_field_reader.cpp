#include "pathscope/wire/field_reader.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

enum class Fruit { apple, pear };
constexpr std::array k_fruit_names{EnumName<Fruit>{Fruit::apple, "apple"},
                                   EnumName<Fruit>{Fruit::pear, "pear"}};
constexpr const auto& enum_table(Fruit) { return k_fruit_names; }

PackMap basket() {
    PackMap inner;
    inner.set("x", 1);
    PackMap map;
    map.set("count", 5);
    map.set("debt", -5);
    map.set("weight", 1.5);
    map.set("ripe", true);
    map.set("name", "a basket");
    map.set("bytes", PackBytes{"\x01\x02"});
    map.set("fruit", "pear");
    map.set("list", PackArray{1, 2, 3});
    map.set("inner", inner);
    map.set("forged", "a\nb");
    return map;
}

/// What the reader says of one access to the basket.
template <class Access>
std::string sentence(Access access) {
    const PackMap map = basket();
    FieldReader fields(map, "BASKET");
    access(fields);
    return fields.error() ? fields.error()->message : "";
}

}  // namespace

TEST_CASE("fields of the right kind are read") {
    const PackMap map = basket();
    FieldReader fields(map, "BASKET");
    CHECK(fields.u64("count") == 5);
    CHECK(fields.u32("count", 5, 5) == 5);
    CHECK(fields.i64("count") == 5);
    CHECK(fields.i64("debt", -5, 0) == -5);
    CHECK(fields.f64("weight", 0, 2) == 1.5);
    CHECK(fields.f64("count") == 5.0);
    CHECK(fields.f64("debt") == -5.0);
    CHECK(fields.boolean("ripe"));
    CHECK(fields.text("name", 1, 8) == "a basket");
    CHECK(fields.bytes("bytes", 2, 2) == "\x01\x02");
    CHECK(fields.enumerator<Fruit>("fruit") == Fruit::pear);
    CHECK(fields.array("list", 3).size() == 3);
    CHECK(fields.map("inner").size() == 1);
    CHECK(fields.has("count"));
    CHECK_FALSE(fields.has("nothing"));
    CHECK_FALSE(fields.error().has_value());
}

TEST_CASE("fields are found in any order, and as often as one likes") {
    const PackMap map = basket();
    FieldReader fields(map, "BASKET");
    CHECK(fields.map("inner").size() == 1);  // The last but one, then those before it.
    CHECK(fields.text("name", 1, 8) == "a basket");
    CHECK(fields.i64("debt") == -5);
    CHECK(fields.i64("debt") == -5);
    CHECK(fields.u64("count") == 5);
    CHECK(fields.f64("weight") == 1.5);
    CHECK_FALSE(fields.error().has_value());
    CHECK(fields.u64("none") == 0);
    CHECK(fields.u64("count") == 5);
    CHECK(fields.error()->message == "BASKET: field 'none' is missing.");
}

TEST_CASE("each sentence names the context, the field and what is wrong") {
    CHECK(sentence([](FieldReader& f) { f.u64("none"); }) == "BASKET: field 'none' is missing.");
    CHECK(sentence([](FieldReader& f) { f.u64("name"); }) == "BASKET: field 'name' is text, not integer.");
    CHECK(sentence([](FieldReader& f) { f.u64("debt"); }).starts_with("BASKET: field 'debt' is -5, which"));
    CHECK(sentence([](FieldReader& f) { f.u32("count", 6, 9); }) ==
          "BASKET: field 'count' is 5, which is not within 6 and 9.");
    CHECK(sentence([](FieldReader& f) { f.u32("count", 0, 4); }) ==
          "BASKET: field 'count' is 5, which is not within 0 and 4.");
    CHECK(sentence([](FieldReader& f) { f.i64("debt", -4); }).starts_with("BASKET: field 'debt' is -5"));
    CHECK(sentence([](FieldReader& f) { f.i64("count", -9, 4); }).starts_with("BASKET: field 'count' is 5"));
    CHECK(sentence([](FieldReader& f) { f.i64("count", 6); }).starts_with("BASKET: field 'count' is 5"));
    CHECK(sentence([](FieldReader& f) { f.f64("weight", 2, 3); }) ==
          "BASKET: field 'weight' is 1.5, which is not within 2 and 3.");
    CHECK(sentence([](FieldReader& f) { f.boolean("count"); }) ==
          "BASKET: field 'count' is integer, not bool.");
    CHECK(sentence([](FieldReader& f) { f.text("name", 1, 7); }) ==
          "BASKET: field 'name' has 8 bytes, which is not within 1 and 7.");
    CHECK(sentence([](FieldReader& f) { f.text("forged", 0, 9); }) ==
          "BASKET: field 'forged' holds control characters.");
    CHECK(sentence([](FieldReader& f) { f.bytes("name", 0, 99); }) ==
          "BASKET: field 'name' is text, not bytes.");
    CHECK(sentence([](FieldReader& f) { f.bytes("bytes", 3, 3); }) ==
          "BASKET: field 'bytes' has 2 bytes, which is not within 3 and 3.");
    CHECK(sentence([](FieldReader& f) { f.enumerator<Fruit>("name"); }) ==
          "BASKET: field 'name' is 'a basket', which is none of apple, pear.");
    CHECK(sentence([](FieldReader& f) { f.array("list", 2); }) ==
          "BASKET: field 'list' has 3 items, more than 2.");
    CHECK(sentence([](FieldReader& f) { f.map("list"); }) == "BASKET: field 'list' is array, not map.");
}

TEST_CASE("not a number is within no range") {
    PackMap map;
    map.set("weight", std::numeric_limits<double>::quiet_NaN());
    FieldReader fields(map, "BASKET");
    CHECK(fields.f64("weight") == std::numeric_limits<double>::lowest());
    CHECK(fields.error().has_value());
}

TEST_CASE("the first error stays") {
    CHECK(sentence([](FieldReader& f) {
              f.u64("none");
              f.text("count", 0, 9);
              f.fail("own", "is odd");
          }) == "BASKET: field 'none' is missing.");
    CHECK(sentence([](FieldReader& f) { f.fail("own", "is odd"); }) == "BASKET: field 'own' is odd.");
}

TEST_CASE("unknown keys are an error only where that is asked for") {
    const std::array<std::string_view, 9> known{"count", "debt",  "weight", "ripe", "name",
                                                "bytes", "fruit", "list",   "inner"};
    CHECK(sentence([&](FieldReader& f) { f.only(known); }) == "BASKET: field 'forged' is not known.");
}
