#include "runtime/io/records.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <numeric>

#include "runtime/base/parallel.h"
#include "runtime/base/per_thread.h"

namespace rapid {
namespace {

static_assert(std::endian::native == std::endian::little, "records are swapped from little-endian memory");

std::uint32_t load_word(const unsigned char* from)
{
    std::uint32_t word;
    std::memcpy(&word, from, sizeof word);
    return word;
}

template <bool swapped>
void store_word(unsigned char* to, std::uint32_t word)
{
    if constexpr (swapped) word = __builtin_bswap32(word);
    std::memcpy(to, &word, sizeof word);
}

// words: a template parameter, so that the loop over it is unrolled.
template <bool swapped, std::size_t words>
void interleave_words(const unsigned char* from, std::size_t stride, unsigned char* to, std::size_t record,
                      std::size_t n)
{
    for (std::size_t i = 0; i < n; ++i, from += stride, to += record)
        for (std::size_t w = 0; w < words; ++w) store_word<swapped>(to + 4 * w, load_word(from + 4 * w));
}

template <bool swapped>
void interleave_narrowed(const unsigned char* from, std::size_t stride, unsigned char* to, std::size_t record,
                         std::size_t n)
{
    // Takes the low word of a little-endian int64. The range was checked when the column was added.
    for (std::size_t i = 0; i < n; ++i, from += stride, to += record) store_word<swapped>(to, load_word(from));
}

void check_fits_int32(const std::string& name, const Column<std::int64_t>& column)
{
    const Strided<std::int64_t> values = column.read();
    const std::size_t distinct = column.is_uniform() ? std::min<std::size_t>(1, column.size()) : column.size();
    for_each_chunk(distinct, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            if (values[i] != static_cast<std::int32_t>(values[i]))
                throw Error(
                    fmt::format("{} = {} does not fit into the int32 of this format (at most {}); write .vdb or .csv, "
                                "which store int64",
                                name, values[i], std::numeric_limits<std::int32_t>::max()));
    });
}

// Calls f with a function that loads a number of the type.
template <class F>
auto with_loader(ScalarType type, ByteOrder order, const F& f)
{
    return with_scalar(type, [&](auto like) {
        return f([order](const unsigned char* p) { return load_scalar<decltype(like)>(p, order); });
    });
}

// Reads the numbers of an attribute.
struct Numbers {
    const Records& records;
    const RecordAttribute& attribute;

    // Sets out[i * step] to the number at `offset` of record i.
    template <class Number>
    void read(std::size_t offset, Number* out, std::size_t step) const
    {
        const double scale = attribute.scale;
        with_loader(attribute.type, records.order, [&](const auto& loader) {
            for_each_chunk(records.points, [&](std::size_t begin, std::size_t end) {
                const unsigned char* from = records.bytes.data() + begin * records.stride + offset;
                if (scale == 1)
                    for (std::size_t i = begin; i < end; ++i, from += records.stride)
                        out[i * step] = static_cast<Number>(loader(from));
                else
                    for (std::size_t i = begin; i < end; ++i, from += records.stride)
                        out[i * step] = static_cast<Number>(scale * static_cast<double>(loader(from)));
            });
        });
    }

    // Calls f(i, number) for each record.
    template <class F>
    void check(std::size_t offset, const F& f) const
    {
        with_loader(attribute.type, records.order, [&](const auto& loader) {
            for_each_chunk(records.points, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i)
                    f(i, loader(records.bytes.data() + i * records.stride + offset));
            });
        });
    }

    // Checks that floating-point ids are integers.
    void check_ids(std::size_t offset) const
    {
        check(offset, [](std::size_t i, auto number) {
            const auto id = static_cast<double>(number);
            if (!(std::abs(id) <= 0x1p53 && id == std::floor(id)))
                throw Error(fmt::format("point {} has the id {}; ids must be whole numbers", i, id));
        });
    }

    // Checks that unsigned 64-bit integers fit into int64.
    void check_fits_int64(std::size_t offset) const
    {
        check(offset, [this](std::size_t i, auto number) {
            if (static_cast<std::uint64_t>(number) > std::numeric_limits<std::int64_t>::max())
                throw Error(fmt::format("point {} has {} = {}; it must be at most 2^63 - 1", i, attribute.name,
                                        static_cast<std::uint64_t>(number)));
        });
    }

    template <class T, class Number>
    Column<T> column(std::span<const std::size_t> offsets) const
    {
        Column<T> column;
        if (records.points == 0) return column;
        std::span<T> values = column.append_for_writing(records.points);
        Number* numbers = reinterpret_cast<Number*>(values.data());
        for (std::size_t c = 0; c < offsets.size(); ++c) read(offsets[c], numbers + c, offsets.size());
        return column;
    }

    bool is_wide() const
    {
        return attribute.type == ScalarType::UInt32 || attribute.type == ScalarType::Int64 ||
               attribute.type == ScalarType::UInt64;
    }
};

}  // namespace

void RecordWriter::push(Part::Encoding encoding, const void* from, std::size_t stride, std::size_t words,
                        std::size_t bytes)
{
    parts_.push_back({encoding, static_cast<const unsigned char*>(from), stride, words, record_bytes_});
    record_bytes_ += bytes;
}

void RecordWriter::add(const std::string& name, const AnyColumn& column)
{
    std::visit(
        [&](const auto& c) {
            using T = std::decay_t<decltype(c[0])>;
            RAPID_ASSERT((!std::is_same_v<T, Token>));
            const Strided<T> values = c.read();
            if (std::is_same_v<T, std::int64_t> && integers_ == Narrow) {
                if constexpr (std::is_same_v<T, std::int64_t>) check_fits_int32(name, c);
                push(Part::Narrowed, values.data, values.stride * sizeof(T), 1, 4);
            } else {
                push(Part::Words, values.data, values.stride * sizeof(T), sizeof(T) / 4, sizeof(T));
            }
        },
        column);
}

void RecordWriter::add_bytes(const Column<std::uint8_t>& column)
{
    const Strided<std::uint8_t> values = column.read();
    push(Part::Byte, values.data, values.stride, 1, 1);
}

void RecordWriter::add_constant(float value)
{
    constants_.push_back(std::make_unique<std::uint32_t>(std::bit_cast<std::uint32_t>(value)));
    push(Part::Words, constants_.back().get(), 0, 1, 4);
}

void RecordWriter::interleave(const Part& part, std::size_t begin, std::size_t end, unsigned char* records) const
{
    const unsigned char* from = part.from + begin * part.stride;
    unsigned char* to = records + part.offset;
    const std::size_t n = end - begin;
    const auto interleaved = [&]<bool swapped>() {
        switch (part.encoding) {
            case Part::Words:
                if (part.words == 1) return interleave_words<swapped, 1>(from, part.stride, to, record_bytes_, n);
                if (part.words == 2) return interleave_words<swapped, 2>(from, part.stride, to, record_bytes_, n);
                if (part.words == 3) return interleave_words<swapped, 3>(from, part.stride, to, record_bytes_, n);
                return interleave_words<swapped, 4>(from, part.stride, to, record_bytes_, n);
            case Part::Narrowed:
                return interleave_narrowed<swapped>(from, part.stride, to, record_bytes_, n);
            case Part::Byte:
                break;
        }
        for (std::size_t i = 0; i < n; ++i) to[i * record_bytes_] = from[i * part.stride];
    };
    if (order_ == ByteOrder::Big)
        interleaved.template operator()<true>();
    else
        interleaved.template operator()<false>();
}

void RecordWriter::interleave(std::size_t begin, std::size_t end, unsigned char* records) const
{
    for (const Part& part : parts_) interleave(part, begin, end, records);
}

void RecordWriter::write(OutputFile& file, std::uint64_t offset, std::size_t points) const
{
    // The records of a chunk, 32 to 128 bytes each, and their columns stay in the second-level cache.
    for_each_chunk(points, [&](std::size_t begin, std::size_t end) {
        // The buffer is kept per thread, so that its pages are touched only once.
        thread_local PerThread<std::vector<unsigned char>> kept;
        std::vector<unsigned char>& records = *kept;
        records.resize((end - begin) * record_bytes_);
        interleave(begin, end, records.data());
        file.write_at(offset + begin * record_bytes_, records.data(), records.size());
    });
}

void read_attribute(PointSet& points, const Records& records, const RecordAttribute& attribute)
{
    const Numbers numbers{records, attribute};
    const std::span<const std::size_t> offsets = attribute.offsets;
    if (attribute.group) {
        std::span<std::uint8_t> members = points.group(attribute.name).overwrite();
        numbers.read(offsets[0], members.data(), 1);
        for (std::uint8_t& member : members) member = member != 0;
        return;
    }
    if (attribute.type == ScalarType::UInt64)
        for (const std::size_t offset : offsets) numbers.check_fits_int64(offset);
    const bool positions = attribute.name == "P" && offsets.size() == 3;  // floats, even if stored as integers
    const bool floating = is_floating(attribute.type) || attribute.scale != 1 || positions;
    if (attribute.name == "id" && offsets.size() == 1) {
        if (is_floating(attribute.type)) numbers.check_ids(offsets[0]);
        points.set("id", numbers.column<std::int64_t, std::int64_t>(offsets));
    } else if (floating && offsets.size() == 3) {
        points.set(attribute.name, numbers.column<Vec3f, float>(offsets));
    } else if (floating && offsets.size() == 4) {
        points.set(attribute.name, numbers.column<Quatf, float>(offsets));
    } else {
        for (std::size_t c = 0; c < offsets.size(); ++c) {
            const std::string name = offsets.size() == 1 ? attribute.name : fmt::format("{}{}", attribute.name, c);
            const std::span<const std::size_t> one = offsets.subspan(c, 1);
            if (floating)
                points.set(name, numbers.column<float, float>(one));
            else if (numbers.is_wide())
                points.set(name, numbers.column<std::int64_t, std::int64_t>(one));
            else
                points.set(name, numbers.column<std::int32_t, std::int32_t>(one));
        }
    }
}

void number_points(PointSet& points)
{
    if (points.empty()) return;
    std::span<std::int64_t> ids = points.id().overwrite();
    std::iota(ids.begin(), ids.end(), std::int64_t{0});
}

PointSet read_records(const Records& records, const std::vector<RecordAttribute>& attributes)
{
    RAPID_ASSERT(records.bytes.size() >= records.points * records.stride);
    PointSet points;
    points.append(records.points);
    for (const RecordAttribute& attribute : attributes) read_attribute(points, records, attribute);
    const bool has_id = std::any_of(attributes.begin(), attributes.end(), [](const RecordAttribute& a) {
        return a.name == "id" && !a.group && a.offsets.size() == 1;
    });
    if (!has_id) number_points(points);
    return points;
}

}  // namespace rapid
