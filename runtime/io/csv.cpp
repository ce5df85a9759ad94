// .csv: a header line, then a line for each point in order of id.
//
//   id,Px,Py,Pz,vx,vy,vz, then further attributes by name (NAMEx NAMEy NAMEz (NAMEw)), then group:NAME, 0 or 1
//
// Floats have 9 significant digits, which identify the float. Strings are quoted, with quotes inside doubled (RFC
// 4180), and so is the name of a column of strings, because a file without points has no values. The file does not
// store other types. On reading, a column whose first value is not a number holds strings. Any other column except id
// is float, unless it contains only integers and float would round one of them. It is then int32, or int64 if that is
// too small.
//
// Files of other programs may have blanks after commas, quoted names, and lines that end with CR. Their vectors NAME:0
// NAME:1 NAME:2 (ParaView), NAME.x NAME.y NAME.z and NAME[0] NAME[1] NAME[2] are read as well, and P may be called x y
// z, Points or position.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <set>

#include "runtime/base/memory_budget.h"
#include "runtime/base/parallel.h"
#include "runtime/files/input_file.h"
#include "runtime/files/scalars.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/io/attribute_names.h"
#include "runtime/io/format.h"
#include "runtime/io/id_order.h"
#include "runtime/io/ordered_chunks.h"
#include "runtime/io/point_file.h"
#include "runtime/io/text_table.h"

namespace rapid {
namespace {

constexpr std::string_view group_column = "group:";
constexpr std::size_t number_chars = 24;  // the longest is an int64 of 20; a float of 9 digits has 15

char* put_number(char* to, float value)
{
    return std::to_chars(to, to + number_chars, value, std::chars_format::general, 9).ptr;
}

template <class Integer>
char* put_number(char* to, Integer value)
{
    return std::to_chars(to, to + number_chars, value).ptr;
}

char* put_value(char* to, float value) { return put_number(to, value); }
char* put_value(char* to, std::int32_t value) { return put_number(to, value); }
char* put_value(char* to, std::int64_t value) { return put_number(to, value); }

char* put_value(char* to, Token value)
{
    *to++ = '"';
    for (const char c : value.text()) {
        if (c == '"') *to++ = '"';
        *to++ = c;
    }
    *to++ = '"';
    return to;
}

template <class Vector>
char* put_numbers(char* to, const Vector& numbers, int count)
{
    for (int c = 0; c < count; ++c) {
        if (c > 0) *to++ = ',';
        to = put_number(to, numbers[c]);
    }
    return to;
}

char* put_value(char* to, const Vec3f& value) { return put_numbers(to, value, 3); }
char* put_value(char* to, const Quatf& value) { return put_numbers(to, value.coeffs(), 4); }

struct CsvTable {
    std::vector<const AnyColumn*> columns;
    std::vector<const Column<std::uint8_t>*> groups;
    std::string header;
    std::size_t numbers = 0;  // per line
};

CsvTable csv_table(const PointSet& points)
{
    CsvTable table;
    std::vector<std::string> attributes = further_attributes(points), names;
    attributes.insert(attributes.begin(), {"id", "P", "v"});
    for (const std::string& name : attributes) {
        table.columns.push_back(points.find(name));
        for (std::string& number : component_names(name, component_count(type_of(*table.columns.back()))))
            names.push_back(std::move(number));
    }
    for (const auto& [name, members] : points.groups()) {
        table.groups.push_back(&members);
        names.push_back(std::string(group_column) + name);
    }
    check_column_names(names, ",\"\r\n");
    for (const std::string& name : names) {
        const AnyColumn* column = points.find(name);
        const bool is_text = column && type_of(*column) == AttributeType::String;
        table.header += (table.header.empty() ? "" : ",") + (is_text ? '"' + name + '"' : name);
    }
    table.header += '\n';
    table.numbers = names.size();
    return table;
}

// Returns the lines of the points [begin, end) of the order.
std::string csv_lines(const CsvTable& table, const std::vector<std::size_t>& order, std::size_t begin, std::size_t end)
{
    std::size_t size = table.numbers * (number_chars + 1) * (end - begin);
    for (const AnyColumn* column : table.columns)
        if (const auto* strings = std::get_if<Column<Token>>(column))
            for (std::size_t i = begin; i < end; ++i)
                size += 2 * (*strings)[order.empty() ? i : order[i]].text().size();
    std::string text(size, '\0');
    char* to = text.data();
    for (std::size_t i = begin; i < end; ++i) {
        const std::size_t point = order.empty() ? i : order[i];
        for (const AnyColumn* column : table.columns) {
            to = std::visit([&](const auto& c) { return put_value(to, c[point]); }, *column);
            *to++ = ',';
        }
        for (const Column<std::uint8_t>* members : table.groups) {
            *to++ = (*members)[point] ? '1' : '0';
            *to++ = ',';
        }
        to[-1] = '\n';
    }
    text.resize(static_cast<std::size_t>(to - text.data()));
    return text;
}

void append_lines(OutputFile& file, const CsvTable& table, const std::vector<std::size_t>& order, std::size_t points)
{
    append_chunks(file, points,
                  [&](std::size_t begin, std::size_t end) { return csv_lines(table, order, begin, end); });
}

void write_csv(OutputFile& file, const PointSet& points, const FrameInfo&)
{
    const CsvTable table = csv_table(points);
    const std::vector<std::size_t> order = id_order(points.id());
    file.append(table.header.data(), table.header.size());
    append_lines(file, table, order, points.size());
}

class CsvStream : public PointStream {
public:
    CsvStream(OutputFile& file, const PointSet& like) : file_(file)
    {
        const CsvTable table = csv_table(like);
        file.append(table.header.data(), table.header.size());
    }
    void append(const PointSet& points) override { append_lines(file_, csv_table(points), {}, points.size()); }
    void finish() override {}

private:
    OutputFile& file_;
};

std::unique_ptr<PointStream> stream_csv(OutputFile& file, const PointSet& like)
{
    return std::make_unique<CsvStream>(file, like);
}

// Returns the end of the line that begins here: a newline outside quotes, or the end of the text.
std::size_t line_end(std::string_view text, std::size_t begin, bool has_quotes)
{
    if (!has_quotes) return std::min(text.find('\n', begin), text.size());
    bool quoted = false;
    for (std::size_t i = begin; i < text.size(); ++i) {
        quoted ^= text[i] == '"';
        if (text[i] == '\n' && !quoted) return i;
    }
    return text.size();
}

const char* without_blanks(const char* at, const char* stop)
{
    while (at != stop && (*at == ' ' || *at == '\t')) ++at;
    return at;
}

// Returns the start of each line, without the header and trailing empty lines.
std::vector<std::size_t> line_starts(std::string_view text, std::size_t begin)
{
    const bool has_quotes = text.find('"') != std::string_view::npos;
    std::vector<std::size_t> starts;
    while (begin < text.size()) {
        starts.push_back(begin);
        begin = line_end(text, begin, has_quotes) + 1;
    }
    while (!starts.empty() && text.substr(starts.back()).find_first_not_of("\r\n") == std::string_view::npos)
        starts.pop_back();
    return starts;
}

// A column of numbers: as double, which represents every float and int32, and as int64 while all of them are integers.
struct CsvColumn {
    std::vector<double> numbers;
    std::vector<std::int64_t> whole;
    bool is_whole = true;
    std::vector<Token> strings = {};  // if it holds strings instead
    bool is_text = false;

    bool float_would_round() const
    {
        return std::any_of(whole.begin(), whole.end(), [](std::int64_t value) {
            // Above 2^53 a double is not exact either, and the cast back could overflow.
            return std::abs(value) > (std::int64_t{1} << 53) ||
                   static_cast<std::int64_t>(static_cast<float>(value)) != value;
        });
    }
    bool fits_int32() const
    {
        return std::all_of(whole.begin(), whole.end(),
                           [](std::int64_t value) { return value == static_cast<std::int32_t>(value); });
    }
};

Error csv_error(std::size_t line, const std::string& what) { return Error(fmt::format("line {}: {}", line, what)); }

// Parses a string, which is in quotes or reaches up to the next comma or the end of the line. Returns where it ends, or
// null if there is no closing quote.
const char* parse_text(const char* at, const char* stop, std::string& text)
{
    text.clear();
    at = without_blanks(at, stop);
    if (at == stop || *at != '"') {
        while (at != stop && *at != ',' && *at != '\n' && *at != '\r') text += *at++;
        return at;
    }
    for (++at; at != stop; ++at) {
        if (*at == '"' && (++at == stop || *at != '"')) return without_blanks(at, stop);
        text += *at;
    }
    return nullptr;
}

// Returns true if a value is not a number.
bool is_text(const char* at, const char* stop)
{
    double number = 0;
    const auto parsed = parse_number(without_blanks(at, stop), stop, number);
    const char* const end = without_blanks(parsed.ptr, stop);
    return parsed.ec == std::errc::invalid_argument || (end != stop && *end != ',' && *end != '\n' && *end != '\r');
}

// Marks columns as strings if the first line has no number there. may_be_text: columns for which this is allowed.
void find_strings(std::string_view line, const std::vector<bool>& may_be_text, std::vector<CsvColumn>& columns)
{
    const char *at = line.data(), *stop = line.data() + line.size();
    std::string text;
    for (std::size_t c = 0; c < columns.size() && at != stop; ++c) {
        columns[c].is_text = may_be_text[c] && is_text(at, stop);
        at = parse_text(at, stop, text);
        if (!at) return;
        if (at != stop && *at == ',') ++at;
    }
}

std::vector<CsvColumn> parse_columns(std::string_view text, const std::vector<std::size_t>& starts,
                                     const std::vector<std::string>& names, const std::vector<bool>& may_be_text,
                                     const std::vector<bool>& is_quoted)
{
    constexpr double bytes_per_number = sizeof(double) + sizeof(std::int64_t);  // per number, until all lines are read
    const double bytes = bytes_per_number * static_cast<double>(names.size()) * static_cast<double>(starts.size());
    if (!fits_in_memory(bytes))
        throw memory_exceeded(fmt::format("{} lines of {} numbers", starts.size(), names.size()), bytes,
                              "split the file, or write .bgeo instead");
    std::vector<CsvColumn> columns(names.size());
    if (!starts.empty()) find_strings(text.substr(starts[0]), may_be_text, columns);
    for (std::size_t c = 0; c < columns.size() && starts.empty(); ++c)
        columns[c].is_text = may_be_text[c] && is_quoted[c];
    for (CsvColumn& column : columns) {
        if (column.is_text) {
            column.strings.resize(starts.size());
            continue;
        }
        column.numbers.resize(starts.size());
        column.whole.resize(starts.size());
    }
    std::vector<std::atomic<bool>> broken(names.size());  // columns with a non-integer number
    for_each_chunk(starts.size(), [&](std::size_t begin, std::size_t end) {
        std::string word;
        StringTokens token_of_word;
        for (std::size_t i = begin; i < end; ++i) {
            const char* at = text.data() + starts[i];
            const char* const stop = text.data() + text.size();
            for (std::size_t c = 0; c < names.size(); ++c) {
                if (c > 0) {
                    if (at == stop || *at != ',')
                        throw csv_error(i + 2, fmt::format("there are {} values; there must be {}", c, names.size()));
                    ++at;
                }
                if (columns[c].is_text) {
                    at = parse_text(at, stop, word);
                    if (!at)
                        throw csv_error(
                            i + 2, fmt::format("{} has no closing quote; the file ends early or is damaged", names[c]));
                    columns[c].strings[i] = token_of_word(word);
                    continue;
                }
                double& number = columns[c].numbers[i];
                std::int64_t& whole = columns[c].whole[i];
                at = without_blanks(at, stop);
                const auto parsed = parse_number(at, stop, number);
                if (parsed.ec != std::errc()) throw csv_error(i + 2, fmt::format("{} is not a number", names[c]));
                const auto parsed_whole = parse_number(at, stop, whole);
                if (parsed_whole.ec != std::errc() || parsed_whole.ptr != parsed.ptr)
                    broken[c].store(true, std::memory_order_relaxed);
                at = without_blanks(parsed.ptr, stop);
            }
            if (at != stop && *at == '\r') ++at;
            if (at != stop && *at != '\n')
                throw csv_error(i + 2, fmt::format("the text after {} values can't be parsed", names.size()));
        }
    });
    for (std::size_t c = 0; c < names.size(); ++c) columns[c].is_whole = !broken[c];
    return columns;
}

// Returns ids that are written with a point: 3.0.
Column<std::int64_t> whole_ids(const CsvColumn& column)
{
    std::vector<std::int64_t> ids;
    for (const double number : column.numbers) {
        if (!(std::abs(number) <= 0x1p53 && number == std::floor(number)))
            throw csv_error(ids.size() + 2, fmt::format("the column id holds numbers that are not whole: {}", number));
        ids.push_back(static_cast<std::int64_t>(number));
    }
    return Column<std::int64_t>(std::span<const std::int64_t>(ids));
}

template <class T, class Number>
Column<T> joined(const std::vector<CsvColumn>& columns, const std::vector<std::size_t>& which)
{
    Column<T> column;
    if (columns[which[0]].numbers.empty()) return column;
    const std::size_t n = columns[which[0]].numbers.size();
    Number* to = reinterpret_cast<Number*>(column.append_for_writing(n).data());
    for (std::size_t i = 0; i < n; ++i)
        for (const std::size_t c : which) {
            if constexpr (std::is_integral_v<Number>)
                *to++ = static_cast<Number>(columns[c].whole[i]);
            else
                *to++ = static_cast<Number>(columns[c].numbers[i]);
        }
    return column;
}

// Reads the names of the columns, and for each if it is in quotes.
std::vector<std::string> header_names(std::string_view header, std::vector<bool>& is_quoted)
{
    std::vector<std::string> names;
    const char *at = header.data(), *const stop = header.data() + header.size();
    for (;; ++at) {
        at = without_blanks(at, stop);
        is_quoted.push_back(at != stop && *at == '"');
        at = parse_text(at, stop, names.emplace_back());
        if (!at) throw csv_error(1, "a name has no closing quote");
        if (!is_quoted.back()) names.back().erase(names.back().find_last_not_of(" \t") + 1);
        if (at == stop || *at == '\r') return names;
        if (*at != ',')
            throw csv_error(1, fmt::format("what follows the name \"{}\" can't be understood", names.back()));
    }
}

// Renames the components of vectors that other programs write to those of Rapid.
void take_names_of_others(std::vector<std::string>& names)
{
    static const std::string patterns[][4] = {
        {":0", ":1", ":2", ":3"}, {".x", ".y", ".z", ".w"}, {"[0]", "[1]", "[2]", "[3]"}};
    static const std::set<std::string> positions = {"Points", "points", "position", "Position"};
    for (std::size_t c = 0; c + 2 < names.size(); ++c)
        for (const auto& suffixes : patterns) {
            if (!names[c].ends_with(suffixes[0]) || names[c].size() == suffixes[0].size()) continue;
            const std::string stem = names[c].substr(0, names[c].size() - suffixes[0].size());
            std::size_t count = 1;
            while (count < 4 && c + count < names.size() && names[c + count] == stem + suffixes[count]) ++count;
            if (count < 3) continue;
            const std::vector<std::string> ours = component_names(positions.count(stem) ? "P" : stem, count);
            std::copy(ours.begin(), ours.end(), names.begin() + static_cast<std::ptrdiff_t>(c));
        }
    if (std::find(names.begin(), names.end(), "Px") != names.end()) return;
    for (const std::string& xyz : {std::string("xyz"), std::string("XYZ")})
        for (std::size_t c = 0; c + 2 < names.size(); ++c)
            if (names[c] == xyz.substr(0, 1) && names[c + 1] == xyz.substr(1, 1) && names[c + 2] == xyz.substr(2, 1))
                for (std::size_t k = 0; k < 3; ++k) names[c + k] = std::string("P") + "xyz"[k];
}

PointSet read_csv(const std::filesystem::path& path)
{
    const InputFile file(path);
    std::string_view text = file.text();
    std::string with_newlines;
    if (text.find('\n') == std::string_view::npos && text.find('\r') != std::string_view::npos) {
        with_newlines = text;
        std::replace(with_newlines.begin(), with_newlines.end(), '\r', '\n');
        text = with_newlines;
    }
    const std::size_t header_end = std::min(text.find('\n'), text.size());
    std::vector<bool> is_quoted;
    std::vector<std::string> names = header_names(text.substr(0, header_end), is_quoted);
    take_names_of_others(names);
    if (std::find(is_quoted.begin(), is_quoted.end(), false) == is_quoted.end())
        is_quoted.assign(names.size(), false);  // another program quotes all names
    const std::vector<JoinedColumns> attributes = join_components(names);
    const bool placed = std::any_of(attributes.begin(), attributes.end(),
                                    [](const JoinedColumns& a) { return a.name == "P" && a.columns.size() == 3; });
    if (!placed) throw csv_error(1, "there are no columns Px,Py,Pz; the first line must name the columns");
    check_column_names(names, "");

    const std::vector<std::size_t> starts = line_starts(text, header_end + 1);
    if (!text.ends_with('\n')) SkippedContents::note(no_last_newline);
    std::vector<bool> may_be_text(names.size());
    for (const JoinedColumns& attribute : attributes)
        may_be_text[attribute.columns[0]] =
            attribute.columns.size() == 1 && attribute.name != "id" && !attribute.name.starts_with(group_prefix);
    const std::vector<CsvColumn> columns = parse_columns(text, starts, names, may_be_text, is_quoted);
    PointSet points;
    points.append(starts.size());
    for (const JoinedColumns& attribute : attributes) {
        const std::vector<std::size_t>& which = attribute.columns;
        const CsvColumn& first = columns[which[0]];
        if (first.is_text) {
            points.set(attribute.name, Column<Token>(std::span<const Token>(first.strings)));
        } else if (which.size() == 3) {
            points.set(attribute.name, joined<Vec3f, float>(columns, which));
        } else if (which.size() == 4) {
            points.set(attribute.name, joined<Quatf, float>(columns, which));
        } else if (attribute.name.starts_with(group_column)) {
            std::span<std::uint8_t> members =
                points.group(std::string_view(attribute.name).substr(group_column.size())).overwrite();
            for (std::size_t i = 0; i < members.size(); ++i) members[i] = first.numbers[i] != 0;
        } else if (attribute.name == "id") {
            points.set("id", first.is_whole ? joined<std::int64_t, std::int64_t>(columns, which) : whole_ids(first));
        } else if (first.is_whole && first.float_would_round()) {
            if (first.fits_int32())
                points.set(attribute.name, joined<std::int32_t, std::int32_t>(columns, which));
            else
                points.set(attribute.name, joined<std::int64_t, std::int64_t>(columns, which));
        } else {
            points.set(attribute.name, joined<float, float>(columns, which));
        }
    }
    if (std::find(names.begin(), names.end(), "id") == names.end() && !points.empty()) {
        std::span<std::int64_t> ids = points.id().overwrite();
        for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::int64_t>(i);
    }
    return points;
}

RAPID_FORMAT(Format{.extension = ".csv",
                    .doc = "a text table with a line for each point in order of id",
                    .write = write_csv,
                    .read = read_csv,
                    .lines_stand_alone = true});
RAPID_POINT_STREAM(".csv", stream_csv);

}  // namespace
}  // namespace rapid
