#include "pathscope/session/checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>

#include "pathscope/core/files.hpp"
#include "pathscope/core/hash.hpp"
#include "pathscope/wire/bytes.hpp"
#include "pathscope/wire/codec.hpp"
#include "pathscope/wire/field_reader.hpp"

namespace pathscope {
namespace {

// Words are moved as they lie in memory, which is the layout of the file on every machine this is built for.
static_assert(std::endian::native == std::endian::little && sizeof(PixelSum) == 24);

constexpr std::string_view k_magic = "PATHSCKP";
constexpr std::uint32_t k_version = 1;
constexpr std::size_t k_hash_bytes = Digest{}.size();
constexpr std::size_t k_piece_bytes = (std::size_t{1} << 17) * 8;
constexpr PackLimits k_header_limits_of_file{16 << 20, 8, 1 << 20};
constexpr std::uint32_t k_max_missing = 1u << 20;  ///< Rounds under way, and those of servers that were lost.

std::string_view text_of(const Digest& digest) {
    return {reinterpret_cast<const char*>(digest.data()), digest.size()};
}

// ---- Arrays of 64-bit words, in pieces, so that packing takes little memory beside the arrays.

template <class T>
concept Words = std::is_trivially_copyable_v<T> && sizeof(T) % 8 == 0;

template <Words T>
void put_array(ByteWriter& out, const std::vector<T>& array) {
    const std::string_view bytes(reinterpret_cast<const char*>(array.data()), array.size() * sizeof(T));
    for (std::size_t begin = 0; begin < bytes.size(); begin += k_piece_bytes) {
        const PackedBytes packed =
            pack_bytes(Codec::shuffle_zstd, std::string(bytes.substr(begin, k_piece_bytes)));
        out.little(std::uint32_t(packed.bytes.size()));
        out.little(std::uint8_t(packed.codec));
        out.raw(packed.bytes);
    }
}

/// Stops at the first thing that is wrong; from then on arrays stay empty.
class ArrayReader {
  public:
    explicit ArrayReader(std::string_view bytes) : in_(bytes) {}

    /// Requires: `count` is what the reader expects of its own accord, or bounded by it.
    template <Words T>
    [[nodiscard]] std::vector<T> take(std::size_t count) {
        std::vector<T> array(good_ ? count : 0);
        char* const bytes = reinterpret_cast<char*>(array.data());
        const std::size_t size = array.size() * sizeof(T);
        for (std::size_t begin = 0; good_ && begin < size; begin += k_piece_bytes) {
            const std::string piece = take_piece(std::min(k_piece_bytes, size - begin));
            if (good_) std::memcpy(bytes + begin, piece.data(), piece.size());
        }
        return good_ ? std::move(array) : std::vector<T>{};
    }
    [[nodiscard]] bool all_read() const { return good_ && in_.remaining() == 0; }

  private:
    std::string take_piece(std::size_t expected_bytes) {
        const auto size = in_.little<std::uint32_t>();
        const auto codec = in_.little<std::uint8_t>();
        const auto packed = size ? in_.raw(*size) : std::nullopt;
        good_ = codec && packed && *codec < k_codec_names.size();
        if (!good_) return {};
        auto piece = unpack_bytes(Codec(*codec), std::string(*packed), expected_bytes);
        good_ = bool(piece);
        return good_ ? std::move(*piece) : std::string{};
    }

    ByteReader in_;
    bool good_ = true;
};

/// Numbers of 32 bits as the words of an array, and back; one that has more becomes one that fits no plan.
template <class From>
std::vector<std::uint64_t> words_of(const From& numbers) {
    return {numbers.begin(), numbers.end()};
}
std::uint32_t number_of(std::uint64_t word) {
    return std::uint32_t(std::min<std::uint64_t>(word, std::numeric_limits<std::uint32_t>::max()));
}

// ---- Parts.

/// The rounds that are missing, as unit * 2^32 + index, unit by unit.
std::vector<std::uint64_t> missing_of(const PartSnapshot& part) {
    std::vector<std::uint64_t> missing;
    for (std::uint32_t unit = 0; unit < part.units.size(); ++unit)
        for (const std::uint32_t index : part.units[unit].missing)
            missing.push_back(std::uint64_t{unit} << 32 | index);
    return missing;
}

PackMap encode_part(const PartSnapshot& part) {
    PackMap map;
    map.set("samples", part.samples);
    map.set("missing", std::uint64_t(missing_of(part).size()));
    map.set("has_noise", !part.variance.empty());
    map.set("mean", part.mean);
    return map;
}

void put_arrays(ByteWriter& out, const PartSnapshot& part) {
    std::vector<std::uint64_t> reached;
    for (const UnitSnapshot& unit : part.units) reached.push_back(unit.reached);
    put_array(out, reached);
    put_array(out, missing_of(part));
    put_array(out, part.sums);
    put_array(out, words_of(part.rounds));
    put_array(out, part.variance);
    for (const auto& scout : part.scouts) put_array(out, scout);
}

// ---- Header.

PackArray encode_dropped(const std::vector<DroppedSample>& dropped) {
    PackArray array;
    for (const DroppedSample& sample : dropped)
        array.emplace_back(PackArray{sample.x, sample.y, sample.sample});
    return array;
}

std::vector<DroppedSample> decode_dropped(FieldReader& fields) {
    std::vector<DroppedSample> dropped;
    for (const PackValue& item : fields.array("dropped", k_max_dropped_listed)) {
        const PackArray* numbers = item.get<PackArray>();
        const auto number = [&](std::size_t i) -> std::uint32_t {
            const auto* value =
                numbers && numbers->size() == 3 ? (*numbers)[i].get<std::uint64_t>() : nullptr;
            if (!value) fields.fail("dropped", "must hold triples of numbers");
            return value ? number_of(*value) : 0;
        };
        dropped.push_back({number(0), number(1), number(2)});
    }
    return dropped;
}

PackMap encode_header(const Checkpoint& checkpoint) {
    const auto& [work, history, frame] = checkpoint;
    PackMap map;
    map.set("build", work.build);
    map.set("state", work.state);
    map.set("block", work.block_size);
    map.set("round", work.round_samples);
    map.set("adaptive", work.sampling.adaptive);
    map.set("target_error", work.sampling.target_error);
    map.set("runs", history.runs);
    map.set("render_s", history.render_s);
    map.set("rounds", history.rounds);
    map.set("tiles", history.tiles);
    map.set("rays", history.rays);
    map.set("samples", history.samples);
    map.set("nonfinite_dropped", history.nonfinite_dropped);
    map.set("saturated", history.saturated);
    map.set("differing_rounds", history.differing_rounds);
    map.set("dropped", encode_dropped(history.dropped));
    map.set("passes_finished", frame.passes_finished);
    map.set("last_pass_finished", frame.last_pass_finished);
    map.set("direct", encode_part(frame.direct));
    map.set("indirect", encode_part(frame.indirect));
    return map;
}

WorkIdentity decode_work(FieldReader& fields) {
    WorkIdentity work;
    work.build = fields.text("build", 0, 1024);
    work.state = fields.map("state");
    work.block_size = int(fields.u32("block", 1, k_max_block_size));
    work.round_samples = fields.u32("round", 1, k_max_samples_per_pixel);
    work.sampling.adaptive = fields.boolean("adaptive");
    work.sampling.target_error = fields.f64("target_error", 0);
    return work;
}

WorkHistory decode_history(FieldReader& fields) {
    WorkHistory history;
    history.runs = fields.u32("runs", 0, 1u << 30);
    history.render_s = fields.f64("render_s", 0);
    history.rounds = fields.u64("rounds");
    history.tiles = fields.u64("tiles");
    history.rays = fields.u64("rays");
    history.samples = fields.u64("samples");
    history.nonfinite_dropped = fields.u64("nonfinite_dropped");
    history.saturated = fields.u64("saturated");
    history.differing_rounds = fields.u64("differing_rounds");
    history.dropped = decode_dropped(fields);
    return history;
}

}  // namespace

std::string encode_checkpoint(const Checkpoint& checkpoint) {
    const std::string header = pack(encode_header(checkpoint));
    ByteWriter out;
    out.raw(k_magic);
    out.little(k_version);
    out.little(std::uint32_t(header.size()));
    out.raw(header);
    put_arrays(out, checkpoint.frame.direct);
    put_arrays(out, checkpoint.frame.indirect);
    out.raw(text_of(hash_text(out.bytes())));
    return out.take();
}

// ---- Reading.

Result<CheckpointFile> CheckpointFile::read(const std::filesystem::path& path) {
    Result<std::string> bytes = read_file(path);
    if (!bytes) return bytes.error();
    return parse(std::move(*bytes), path.string());
}

Result<CheckpointFile> CheckpointFile::parse(std::string bytes, std::string name) {
    CheckpointFile file;
    file.name_ = std::move(name);
    file.bytes_ = std::move(bytes);
    const std::string_view whole = file.bytes_;
    if (!whole.starts_with(k_magic)) return bad_input(fmt::format("{} is no checkpoint.", file.name_));
    const std::size_t sealed = whole.size() - std::min(whole.size(), k_hash_bytes);
    if (text_of(hash_text(whole.substr(0, sealed))) != whole.substr(sealed))
        return bad_input(fmt::format("{} is damaged or cut off.", file.name_));

    ByteReader in(whole.substr(0, sealed));
    const auto magic = in.raw(k_magic.size());
    const auto version = in.little<std::uint32_t>();
    if (version && *version != k_version)
        return bad_input(fmt::format("{} is a checkpoint of version {}; this program reads version {}.",
                                     file.name_, *version, k_version));
    const auto header_bytes = in.little<std::uint32_t>();
    const auto header = header_bytes ? in.raw(*header_bytes) : std::nullopt;
    if (!magic || !header) return bad_input(fmt::format("{}: its header is cut off.", file.name_));
    file.arrays_begin_ = sealed - in.remaining();
    file.arrays_end_ = sealed;
    if (const auto read = file.read_header(*header); !read)
        return bad_input(fmt::format("{}: {}", file.name_, read.error().message));
    return file;
}

Result<void> CheckpointFile::read_header(std::string_view header) {
    const Result<PackValue> value = unpack(header, k_header_limits_of_file);
    if (!value) return value.error();
    const PackMap* map = value->get<PackMap>();
    if (!map) return bad_input("Its header is not a map.");
    FieldReader fields(*map, "header");
    work_ = decode_work(fields);
    history_ = decode_history(fields);
    passes_finished_ = fields.u32("passes_finished");
    last_pass_finished_ = fields.boolean("last_pass_finished");
    for (const auto& [name, part] : {std::pair("direct", &direct_), std::pair("indirect", &indirect_)}) {
        FieldReader of_part(fields.map(name), name);
        part->samples = of_part.u32("samples", 0, k_max_samples_per_pixel);
        part->missing = of_part.u32("missing", 0, k_max_missing);
        part->has_noise = of_part.boolean("has_noise");
        part->mean = of_part.f64("mean", 0);
        if (of_part.error()) fields.fail(name, "is wrong: " + of_part.error()->message);
    }
    if (fields.error()) return *fields.error();
    return {};
}

Result<FrameSnapshot> CheckpointFile::frame(const BlockGrid& grid) const {
    ArrayReader in(std::string_view(bytes_).substr(arrays_begin_, arrays_end_ - arrays_begin_));
    const bool staged = work_.sampling.staged();
    const std::size_t pixels = std::size_t(grid.width()) * std::size_t(grid.height());
    const auto read_part = [&](const PartHeader& header, PartSnapshot& part) {
        if (header.samples == 0) return true;
        part.samples = header.samples;
        part.mean = header.mean;
        for (const std::uint64_t word : in.take<std::uint64_t>(units_of_frame(grid.count(), staged)))
            part.units.push_back({number_of(word), {}});
        for (const std::uint64_t word : in.take<std::uint64_t>(header.missing)) {
            if (word >> 32 >= part.units.size()) return false;
            part.units[word >> 32].missing.push_back(std::uint32_t(word));
        }
        part.sums = in.take<PixelSum>(pixels);
        if (!staged) return true;
        for (const std::uint64_t word : in.take<std::uint64_t>(grid.count()))
            part.rounds.push_back(number_of(word));
        if (header.has_noise) part.variance = in.take<double>(grid.count());
        for (auto& scout : part.scouts) scout = in.take<PixelSum>(pixels);
        return true;
    };
    FrameSnapshot frame{passes_finished_, last_pass_finished_, {}, {}};
    if (!read_part(direct_, frame.direct) || !read_part(indirect_, frame.indirect) || !in.all_read())
        return bad_input("Its arrays are not those of this frame.");
    return frame;
}

Result<void> take_up(const CheckpointFile& file, const RenderState& state, FrameWork& work,
                     EventStore& store) {
    if (const auto differs = difference(file.work(), identity_of(state, work.plan())))
        return bad_input(fmt::format("{} is of other work: {}.", file.name(), *differs));
    Result<FrameSnapshot> frame = file.frame(work.grid());
    const Result<void> restored = frame ? work.restore(std::move(*frame)) : Result<void>(frame.error());
    if (!restored)
        return bad_input(fmt::format("{} does not fit: {}", file.name(), restored.error().message));
    const WorkHistory& history = file.history();
    store.count_earlier({{Counter::tiles, history.tiles},
                         {Counter::rays, history.rays},
                         {Counter::samples, history.samples},
                         {Counter::differing_rounds, history.differing_rounds},
                         {Counter::nonfinite_dropped, history.nonfinite_dropped}});
    return {};
}

}  // namespace pathscope
