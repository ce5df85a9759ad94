// PLY files, ascii or binary of either byte order, for points and for meshes: the header, then the elements in the
// order of the file.
//
// Nothing in a file is trusted: what it promises is checked against its size before memory is taken, a number against
// its type. Errors say what is wrong; who calls adds the file's name.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/files/scalars.h"

namespace rapid {

struct PlyProperty {
    std::string name;
    ScalarType type = ScalarType::Float;
    bool list = false;
    ScalarType count_type = ScalarType::UInt8;
};

struct PlyElement {
    std::string name;
    std::size_t count = 0;
    std::vector<PlyProperty> properties;

    bool has_lists() const;
    std::size_t stride() const;  // bytes of its scalar properties, and of the counts of its lists
};

// The rows of an element without lists.
struct PlyRecords {
    std::span<const unsigned char> bytes;
    std::size_t stride;
    ByteOrder order;
    std::vector<unsigned char> parsed;  // what an ascii file's bytes are
};

class PlyFile {
public:
    // `text` must outlive the object. Error: no header, or a wrong one.
    explicit PlyFile(std::string_view text);

    const std::vector<PlyElement>& elements() const { return elements_; }

    // The elements are read, or passed over, in their order, and all of them: a file may be cut in its last one.
    PlyRecords read_records(const PlyElement& element);
    void read_lists(const PlyElement& element, std::size_t property,
                    const std::function<void(std::span<const std::int64_t> list)>& row);
    // Of the row whose list is told: its numbers that are in no list, by property.
    double number_of_row(std::size_t property) const { return numbers_[property]; }
    void pass_over(const PlyElement& element);

private:
    enum class Encoding { Ascii, Little, Big };

    void read_header();
    void read_line(const std::vector<std::string>& words);
    ByteOrder order() const { return encoding_ == Encoding::Big ? ByteOrder::Big : ByteOrder::Little; }
    void check_promise(const PlyElement& element) const;
    double parse_number(const PlyElement& element, std::size_t row, const PlyProperty& property, ScalarType type);
    double take_number(const PlyElement& element, std::size_t row, const PlyProperty& property, ScalarType type);

    std::string_view text_;
    std::size_t at_ = 0;
    Encoding encoding_ = Encoding::Ascii;
    std::vector<PlyElement> elements_;
    std::vector<double> numbers_;  // of the row that is read by read_lists()
};

}  // namespace rapid
