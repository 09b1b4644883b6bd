#include "pathscope/scene/mtl.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "text_scan.hpp"

namespace pathscope {
namespace {

constexpr float k_any = std::numeric_limits<float>::max();
constexpr float k_default_ior = 1.5f;

/// The statements of one newmtl, as far as they were made.
struct Statements {
    std::string name;
    std::optional<Rgb> kd, ks, ke;
    std::optional<float> ns, ni, d, tr, pr, pm;
    std::optional<int> illum;
    MapName map_kd, map_ks, map_ke, map_d, map_pr;
};

struct ColourStatement {
    std::string_view keyword;
    std::optional<Rgb> Statements::*target;
    float highest;
};
constexpr ColourStatement k_colours[] = {
    {"Kd", &Statements::kd, 1}, {"Ks", &Statements::ks, 1}, {"Ke", &Statements::ke, k_any}};

struct NumberStatement {
    std::string_view keyword;
    std::optional<float> Statements::*target;
    float highest;
};
constexpr NumberStatement k_numbers[] = {{"Ns", &Statements::ns, k_any}, {"Ni", &Statements::ni, k_any},
                                         {"d", &Statements::d, 1},       {"Tr", &Statements::tr, 1},
                                         {"Pr", &Statements::pr, 1},     {"Pm", &Statements::pm, 1}};

struct MapStatement {
    std::string_view keyword;
    MapName Statements::*target;
};
constexpr MapStatement k_maps[] = {{"map_Kd", &Statements::map_kd},
                                   {"map_Ks", &Statements::map_ks},
                                   {"map_Ke", &Statements::map_ke},
                                   {"map_d", &Statements::map_d},
                                   {"map_Pr", &Statements::map_pr}};

/// Statements that would change the picture, were they known.
constexpr std::string_view k_unused[] = {"bump",   "map_bump", "map_Bump", "norm",     "map_Ns", "map_Pm",
                                         "map_Ps", "disp",     "map_disp", "map_Disp", "refl",   "decal",
                                         "map_Tr", "Ps",       "Pc",       "Pcr",      "aniso",  "anisor"};

struct MapOption {
    std::string_view name;
    int most_arguments;
    bool numbers;
    std::string_view harmless;  ///< Value that changes nothing; the option is passed over in silence then.
};
constexpr MapOption k_map_options[] = {
    {"-s", 3, true, ""},           {"-o", 3, true, ""},          {"-t", 3, true, "0"},
    {"-mm", 2, true, ""},          {"-bm", 1, true, "1"},        {"-boost", 1, true, "1"},
    {"-texres", 1, true, ""},      {"-blendu", 1, false, "on"},  {"-blendv", 1, false, "on"},
    {"-clamp", 1, false, "off"},   {"-cc", 1, false, "off"},     {"-imfchan", 1, false, ""},
    {"-type", 1, false, "sphere"}, {"-colorspace", 1, false, ""}};

template <class Table>
auto find_keyword(const Table& table, std::string_view keyword) {
    return std::find_if(std::begin(table), std::end(table),
                        [keyword](const auto& entry) { return entry.keyword == keyword; });
}

MaterialKind kind_of(const Statements& s) {
    switch (s.illum.value_or(2)) {
        case 0:
        case 1:
            return MaterialKind::lambert;
        case 4:
        case 6:
            return MaterialKind::thin_glass;
        case 5:
            return MaterialKind::mirror;
        case 7:
        case 9:
            return MaterialKind::dielectric;
        default:
            return MaterialKind::standard;
    }
}

/// Blinn-Phong of exponent Ns is nearest to a Beckmann or GGX lobe of this alpha (Walter et al. 2007, sec. 5.2).
float roughness_of_exponent(float ns) { return std::sqrt(std::sqrt(2 / (ns + 2))); }

Rgb grey(float value) { return {value, value, value}; }

MaterialSource source_of(Statements&& s) {
    MaterialSource source;
    Material& m = source.material;
    m.name = std::move(s.name);
    m.kind = kind_of(s);
    m.ior = s.ni && *s.ni >= 1 ? *s.ni : k_default_ior;

    // A map without a value shows as it is. A material of the PBR kind that says no Ks is a plain dielectric.
    const bool is_pbr = s.pr || s.pm || !s.map_pr.name.empty();
    const float f0 = (m.ior - 1) / (m.ior + 1) * ((m.ior - 1) / (m.ior + 1));
    const auto or_map = [](const std::optional<Rgb>& value, const MapName& map, Rgb otherwise) {
        return value.value_or(map.name.empty() ? otherwise : grey(1));
    };
    m.kd = or_map(s.kd, s.map_kd, grey(0));
    m.ks = or_map(s.ks, s.map_ks, grey(is_pbr ? f0 : m.kind == MaterialKind::mirror ? 1.0f : 0.0f));
    m.ke = or_map(s.ke, s.map_ke, grey(0));

    m.roughness = s.pr ? *s.pr : s.ns ? roughness_of_exponent(*s.ns) : 1.0f;
    m.metallic = s.pm.value_or(0.0f);
    m.opacity = s.d.value_or(1 - s.tr.value_or(0.0f));
    source.map_kd = std::move(s.map_kd);
    source.map_ks = std::move(s.map_ks);
    source.map_ke = std::move(s.map_ke);
    source.map_d = std::move(s.map_d);
    source.map_roughness = std::move(s.map_pr);
    return source;
}

class MtlReader {
  public:
    explicit MtlReader(const std::string& shown_path) : shown_path_(shown_path) {}

    Result<MtlFile> run(std::string_view text) {
        if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // A byte order mark of UTF-8.
        while (!text.empty() && !error_) {
            ++line_;
            read_line(take_line(text));
        }
        finish_material();
        if (error_) return *error_;
        return std::move(file_);
    }

  private:
    void fail(std::string_view sentence) {
        if (!error_) error_ = bad_input(fmt::format("{}:{}: {}", shown_path_, line_, sentence));
    }
    void mention(std::string_view sentence) {
        file_.oddities.push_back(fmt::format("{}:{}: {}", shown_path_, line_, sentence));
    }

    void read_line(std::string_view line) {
        const std::string_view keyword = take_word(line);
        if (keyword.empty() || keyword.front() == '#') return;
        if (keyword == "newmtl") return start_material(rest_of(line));

        const auto colour = find_keyword(k_colours, keyword);
        const auto number = find_keyword(k_numbers, keyword);
        const auto map = find_keyword(k_maps, keyword);
        const bool is_known = colour != std::end(k_colours) || number != std::end(k_numbers) ||
                              map != std::end(k_maps) || keyword == "illum";
        if (is_known && !current_)
            return fail(fmt::format("\"{}\" stands before any newmtl; the file is damaged.", keyword));
        if (colour != std::end(k_colours))
            (*current_).*colour->target = read_colour(*colour, line);
        else if (number != std::end(k_numbers))
            (*current_).*number->target = read_number(keyword, take_word(line), number->highest);
        else if (map != std::end(k_maps))
            (*current_).*map->target = read_map(keyword, line);
        else if (keyword == "illum")
            current_->illum = int(read_number(keyword, take_word(line), 1000));
        else if (std::find(std::begin(k_unused), std::end(k_unused), keyword) != std::end(k_unused))
            file_.unused.emplace(keyword);
    }

    void start_material(std::string_view name) {
        if (name.empty()) return fail("newmtl needs a name.");
        finish_material();
        current_.emplace();
        current_->name = name;
        if (!names_.emplace(name).second)
            mention(fmt::format("there is a material \"{}\" before; this one is not used.", name));
    }

    void finish_material() {
        if (!current_) return;
        file_.materials.push_back(source_of(std::move(*current_)));
        current_.reset();
        const Material& m = file_.materials.back().material;
        if (m.opacity == 0)
            mention(fmt::format(
                "\"{}\" is invisible, by its d or Tr; if that is not meant, override its opacity.", m.name));
    }

    float read_number(std::string_view keyword, std::string_view word, float highest) {
        const std::optional<double> number = number_of(word);
        if (!number || !std::isfinite(float(*number))) {
            fail(word.empty()
                     ? fmt::format("{} needs a number; the file is cut off or damaged.", keyword)
                     : fmt::format("{} needs a number, and \"{}\" is none.", keyword, word.substr(0, 40)));
            return 0;
        }
        const auto value = float(*number);
        if (value >= 0 && value <= highest) return value;
        const float nearest = value < 0 ? 0 : highest;
        mention(fmt::format("{} {} is taken as {}.", keyword, value, nearest));
        return nearest;
    }

    /// Kd r g b, or Kd r for a grey.
    Rgb read_colour(const ColourStatement& statement, std::string_view line) {
        Rgb colour = grey(read_number(statement.keyword, take_word(line), statement.highest));
        const std::string_view green = take_word(line);
        if (green.empty() || green.front() == '#') return colour;
        colour.y = read_number(statement.keyword, green, statement.highest);
        colour.z = read_number(statement.keyword, take_word(line), statement.highest);
        return colour;
    }

    /// Options, then a file name that may hold blanks.
    MapName read_map(std::string_view keyword, std::string_view line) {
        MapName map;
        for (;;) {
            line = rest_of(line);
            std::string_view after = line;
            const std::string_view word = take_word(after);
            const auto option = std::find_if(std::begin(k_map_options), std::end(k_map_options),
                                             [word](const MapOption& o) { return o.name == word; });
            if (option == std::end(k_map_options)) break;
            line = read_option(keyword, *option, after, map);
        }
        if (line.empty()) fail(fmt::format("{} names no file.", keyword));
        map.name = line;
        return map;
    }

    /// Returns the line after the option. Numbers end where the file name begins; the last word is always that.
    std::string_view read_option(std::string_view keyword, const MapOption& option, std::string_view line,
                                 MapName& map) {
        float numbers[3] = {};
        int count = 0;
        bool is_harmless = !option.harmless.empty();
        for (; count < option.most_arguments; ++count) {
            std::string_view after = line;
            const std::string_view word = take_word(after);
            const std::optional<double> number = number_of(word);
            if (option.numbers && (!number || rest_of(after).empty())) break;
            if (option.numbers) numbers[count] = float(*number);
            const bool is_same =
                option.numbers ? number == number_of(option.harmless) : word == option.harmless;
            is_harmless = is_harmless && is_same;
            line = after;
        }
        for (const float number : numbers)
            if (!std::isfinite(number))
                fail(fmt::format("{} {} needs finite numbers.", keyword, option.name));
        if (option.name == "-s")
            map.scale = {count > 0 ? numbers[0] : 1.0f, count > 1 ? numbers[1] : 1.0f};
        else if (option.name == "-o")
            map.offset = {numbers[0], numbers[1]};
        else if (!is_harmless)
            file_.unused.emplace(fmt::format("{} {}", keyword, option.name));
        return line;
    }

    const std::string& shown_path_;
    MtlFile file_;
    std::set<std::string, std::less<>> names_;
    std::optional<Statements> current_;
    std::size_t line_ = 0;
    std::optional<Error> error_;
};

}  // namespace

Result<MtlFile> parse_mtl(std::string_view text, const std::string& shown_path) {
    return MtlReader(shown_path).run(text);
}

}  // namespace pathscope
