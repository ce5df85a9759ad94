// Reads .vtk: VTK's legacy files of PolyData or unstructured grids, text or binary ("VTK File Formats", "Simple Legacy
// Formats"). Cells are skipped; data at points becomes attributes.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/files/input_file.h"
#include "runtime/files/scalars.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/io/attribute_names.h"
#include "runtime/io/format.h"
#include "runtime/io/records.h"

namespace rapid {
namespace {

ScalarType vtk_scalar(const std::string& name)
{
    static const std::map<std::string, ScalarType> types = {
        {"char", ScalarType::Int8},          {"unsigned_char", ScalarType::UInt8},
        {"short", ScalarType::Int16},        {"unsigned_short", ScalarType::UInt16},
        {"int", ScalarType::Int32},          {"unsigned_int", ScalarType::UInt32},
        {"long", ScalarType::Int64},         {"unsigned_long", ScalarType::UInt64},
        {"vtktypeint64", ScalarType::Int64}, {"vtktypeuint64", ScalarType::UInt64},
        {"vtkidtype", ScalarType::Int32},    {"float", ScalarType::Float},
        {"double", ScalarType::Double}};
    std::string lower = name;
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    const auto found = types.find(lower);
    if (found == types.end()) throw Error(fmt::format("unknown type \"{}\"", name));
    return found->second;
}

class LegacyReader {
public:
    explicit LegacyReader(std::string_view text) : text_(text) {}

    PointSet read()
    {
        read_header();
        while (skip_space(), at_ < text_.size()) read_section(word());
        if (!points_) throw Error("the file has no POINTS");
        check_column_names(names_, "");
        if (std::find(names_.begin(), names_.end(), "id") == names_.end()) number_points(*points_);
        return std::move(*points_);
    }

private:
    enum class At { Points, Cells, Whole };  // what the current data belongs to

    struct Array {
        std::string name;
        ScalarType type;
        std::size_t numbers, rows;
    };

    static bool is_white_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

    void skip_space()
    {
        while (at_ < text_.size() && is_white_space(text_[at_])) ++at_;
    }
    std::string word()
    {
        skip_space();
        const std::size_t begin = at_;
        while (at_ < text_.size() && !is_white_space(text_[at_])) ++at_;
        return std::string(text_.substr(begin, at_ - begin));
    }
    std::string_view line()
    {
        const std::size_t end = std::min(text_.find('\n', at_), text_.size());
        const std::string_view line = text_.substr(at_, end - at_);
        at_ = std::min(end + 1, text_.size());
        return line.ends_with('\r') ? line.substr(0, line.size() - 1) : line;
    }
    std::size_t count()
    {
        const std::string text = word();
        std::size_t number = 0;
        const auto [end, error] = parse_number(text.data(), text.data() + text.size(), number);
        if (error != std::errc() || end != text.data() + text.size())
            throw Error(fmt::format("\"{}\" is not a number; a count must be there", text.substr(0, 40)));
        return number;
    }
    // Returns a name, whose blanks and percent signs VTK writes as %20 and %25.
    std::string name()
    {
        std::string name = word();
        for (const auto& [code, character] : {std::pair("%20", " "), std::pair("%25", "%")})
            for (std::size_t at = 0; (at = name.find(code, at)) != std::string::npos; ++at)
                name.replace(at, 3, character);
        return name;
    }

    void read_header()
    {
        constexpr std::string_view mark = "# vtk DataFile Version ";
        const std::string_view first = line();
        if (!first.starts_with(mark))
            throw Error("not a legacy file of VTK: it does not begin with \"# vtk DataFile\"");
        const std::string_view version = first.substr(mark.size());
        split_cells_ = !version.empty() && version[0] >= '5';
        line();  // the title
        const std::string encoding = word();
        if (encoding != "ASCII" && encoding != "BINARY")
            throw Error(fmt::format("its encoding is \"{}\"; it must be ASCII or BINARY", encoding));
        binary_ = encoding == "BINARY";
        word();  // DATASET
        const std::string type = word();
        if (type != "POLYDATA" && type != "UNSTRUCTURED_GRID")
            throw Error(fmt::format("it has {}; it must have POLYDATA or an UNSTRUCTURED_GRID", type));
    }

    void read_section(const std::string& keyword)
    {
        if (keyword == "POINTS") {
            const std::size_t n = count();
            read_points({"P", vtk_scalar(word()), 3, n});
        } else if (keyword == "CELLS" || keyword == "VERTICES" || keyword == "LINES" || keyword == "POLYGONS" ||
                   keyword == "TRIANGLE_STRIPS") {
            read_cells(keyword);
        } else if (keyword == "CELL_TYPES") {
            skip({keyword, ScalarType::Int32, 1, count()});
        } else if (keyword == "POINT_DATA" || keyword == "CELL_DATA") {
            rows_ = count();
            place_ = keyword == "POINT_DATA" ? At::Points : At::Cells;
        } else if (keyword == "SCALARS") {
            Array array{name(), vtk_scalar(word()), 1, rows_};
            if (const std::string rest(line()); rest.find_first_not_of(" \t") != std::string::npos)
                array.numbers = static_cast<std::size_t>(std::strtoul(rest.c_str(), nullptr, 10));
            word(), word();  // LOOKUP_TABLE and its name
            read_array(array);
        } else if (keyword == "VECTORS" || keyword == "NORMALS" || keyword == "TENSORS") {
            const std::string called = name();
            read_array(
                {keyword == "NORMALS" ? "N" : called, vtk_scalar(word()), keyword == "TENSORS" ? 9u : 3u, rows_});
        } else if (keyword == "TEXTURE_COORDINATES") {
            const std::string called = name();
            const std::size_t numbers = count();
            read_array({called, vtk_scalar(word()), numbers, rows_});
        } else if (keyword == "COLOR_SCALARS") {
            const std::string called = name();
            read_array({called, binary_ ? ScalarType::UInt8 : ScalarType::Float, count(), rows_});
        } else if (keyword == "LOOKUP_TABLE") {
            word();
            skip({keyword, binary_ ? ScalarType::UInt8 : ScalarType::Float, 4, count()});
        } else if (keyword == "FIELD") {
            read_field();
        } else if (keyword == "METADATA") {
            line();
            while (at_ < text_.size() && !line().empty()) continue;
        } else {
            throw Error(fmt::format("\"{}\" can't be understood at byte {}", keyword.substr(0, 40), at_));
        }
    }

    void read_cells(const std::string& keyword)
    {
        const std::size_t first = count(), second = count();
        if (!split_cells_) return skip({keyword, ScalarType::Int32, 1, second});
        for (const std::size_t numbers : {first, second}) {
            if (numbers == 0) continue;
            word();  // OFFSETS, CONNECTIVITY
            skip({keyword, vtk_scalar(word()), 1, numbers});
        }
    }

    void read_field()
    {
        word();
        for (std::size_t left = count(); left > 0; --left) {
            Array array{name(), ScalarType::Float, 0, 0};
            if (array.name == "METADATA") {  // of the array before
                line();
                while (at_ < text_.size() && !line().empty()) continue;
                array.name = name();
            }
            array.numbers = count();
            array.rows = count();
            array.type = vtk_scalar(word());
            read_array(array);
        }
    }

    // Returns the numbers of an array, in the order of bytes of order().
    std::vector<unsigned char> bytes_of(const Array& array)
    {
        const std::size_t bytes = scalar_bytes(array.type);
        const std::size_t least = binary_ ? bytes : 2;
        const std::size_t left = text_.size() - at_ + !binary_;
        if (array.numbers > 0 && array.rows > left / least / array.numbers)
            throw Error(fmt::format("the file ends early: \"{}\" should have {} rows of {} numbers", array.name,
                                    array.rows, array.numbers));
        const std::size_t all = array.rows * array.numbers;
        if (binary_) {
            line();  // the rest of the line before
            if (all * bytes > text_.size() - at_) throw Error(fmt::format("the file ends within \"{}\"", array.name));
            const auto* from = reinterpret_cast<const unsigned char*>(text_.data() + at_);
            at_ += all * bytes;
            return {from, from + all * bytes};
        }
        std::vector<unsigned char> numbers(all * bytes);
        with_scalar(array.type, [&](auto like) {
            using Number = std::conditional_t<std::is_same_v<decltype(like), Half>, float, decltype(like)>;
            for (std::size_t i = 0; i < all; ++i) {
                skip_space();
                Number number = 0;
                const auto parsed = parse_number(text_.data() + at_, text_.data() + text_.size(), number);
                if (parsed.ec != std::errc())
                    throw Error(
                        fmt::format("\"{}\" has no number of its type in row {}", array.name, i / array.numbers));
                at_ = static_cast<std::size_t>(parsed.ptr - text_.data());
                std::memcpy(numbers.data() + i * bytes, &number, sizeof number);
            }
        });
        return numbers;
    }

    void skip(const Array& array) { bytes_of(array); }

    void read_points(const Array& array)
    {
        if (points_) throw Error("the file has several POINTS; it must have one");
        const std::vector<unsigned char> bytes = bytes_of(array);
        points_.emplace();
        points_->append(array.rows);
        if (!is_floating(array.type)) throw Error("its POINTS are integers; they must be floating numbers");
        set(array, bytes);
    }

    void read_array(const Array& array)
    {
        const std::vector<unsigned char> bytes = bytes_of(array);
        if (place_ != At::Points) return;
        if (!points_ || array.rows != points_->size() || array.numbers == 0 || array.numbers > max_numbers)
            return SkippedContents::add(
                fmt::format("the array \"{}\" of {} rows of {} numbers", array.name, array.rows, array.numbers));
        set(array, bytes);
    }

    void set(const Array& array, const std::vector<unsigned char>& bytes)
    {
        names_.push_back(array.name);
        if (array.rows == 0) return;
        RecordAttribute attribute;
        attribute.name = array.name;
        attribute.type = array.type;
        const std::size_t number = scalar_bytes(array.type);
        for (std::size_t c = 0; c < array.numbers; ++c) attribute.offsets.push_back(c * number);
        read_attribute(*points_,
                       {bytes, array.rows, array.numbers * number, binary_ ? ByteOrder::Big : ByteOrder::Little},
                       attribute);
    }

    std::string_view text_;
    std::size_t at_ = 0;
    bool binary_ = false;
    bool split_cells_ = false;  // since version 5, cells are offsets and connectivity
    At place_ = At::Whole;
    std::size_t rows_ = 0;  // of the current data
    std::optional<PointSet> points_;
    std::vector<std::string> names_;
};

PointSet read_vtk(const std::filesystem::path& path)
{
    const InputFile file(path);
    return LegacyReader(file.text()).read();
}

RAPID_POINT_READER(".vtk", read_vtk);

}  // namespace
}  // namespace rapid
