// The arrays of VTK's XML files: in the XML as text ("ascii") or base64 ("binary"), or appended to it, raw or as
// base64; compressed by zlib or not; of either order of bytes.
//
// Nothing in a file is trusted. Errors say what is wrong; who calls adds the file's name.
#pragma once

#include <optional>
#include <pugixml.hpp>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/files/scalars.h"
#include "runtime/points/token.h"

namespace rapid {

// The whole text as a number; nothing where it is none.
std::optional<std::size_t> whole_number(std::string_view text);

struct VtkArray {
    ScalarType type;
    std::size_t numbers;  // of each row
    ByteOrder order;
    std::span<const unsigned char> bytes;
    std::vector<unsigned char> decoded;  // what they are, where they are not in the file
};

class VtkFile {
public:
    // `text` must outlive it. Error: no XML of VTK; another type; a compressor that is not known.
    VtkFile(std::string_view text, std::string_view type);

    const pugi::xml_document& document() const { return document_; }

    // An array of so many texts, each ended by a 0. Error: it is not there, or holds fewer.
    std::vector<Token> texts(pugi::xml_node node, std::size_t rows) const;

    // An array of so many rows; nothing for those that are no attribute: of text, of bits, of more than 16 numbers a
    // row. Error: an array that is not there, or holds less.
    std::optional<VtkArray> array(pugi::xml_node node, std::size_t rows) const;

private:
    // How many bytes the array holds whose data begin here.
    std::size_t bytes_of(std::string_view text, bool base64) const;
    // The data of an array that is in the XML or appended to it, and whether they are base64.
    std::pair<std::string_view, bool> data_of(pugi::xml_node node, std::string_view text) const;
    // The bytes that `text` holds behind their count, as they are.
    std::span<const unsigned char> raw(std::string_view text, std::size_t wanted) const;
    // The same where they are encoded or compressed.
    std::vector<unsigned char> decode(std::string_view text, bool base64, std::size_t wanted) const;
    std::size_t header_number(std::span<const unsigned char> bytes, std::size_t index) const;

    pugi::xml_document document_;
    std::string_view appended_;
    bool appended_base64_ = false, wide_header_ = false, compressed_ = false;
    ByteOrder order_ = ByteOrder::Little;
};

}  // namespace rapid
