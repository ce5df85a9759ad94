// The arrays of VTK's XML files: inside the XML as text ("ascii") or Base64 ("binary"), or appended to it, raw or as
// Base64; optionally compressed by zlib; in either byte order.
//
// Nothing in a file is trusted. Errors do not contain the file's name; the caller adds it.
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

// Parses the whole text as an unsigned integer. Returns nothing if it is not one.
std::optional<std::size_t> whole_number(std::string_view text);

struct VtkArray {
    ScalarType type;
    std::size_t numbers;  // per row
    ByteOrder order;
    std::span<const unsigned char> bytes;
    std::vector<unsigned char> decoded;  // storage for bytes that had to be decoded
};

class VtkFile {
public:
    // `text` must outlive it. Throws Error if the text is not VTK XML of this type, or uses an unknown compressor.
    VtkFile(std::string_view text, std::string_view type);

    const pugi::xml_document& document() const { return document_; }

    // Reads an array of `rows` strings, each terminated by a zero byte. Throws Error if it is missing or too short.
    std::vector<Token> texts(pugi::xml_node node, std::size_t rows) const;

    // Reads an array with `rows` rows. Returns nothing for arrays that can't be attributes: strings, bits, more than 16
    // numbers per row. Throws Error if the array is missing or too short.
    std::optional<VtkArray> array(pugi::xml_node node, std::size_t rows) const;

private:
    // Returns the number of bytes in the array whose data begin here.
    std::size_t bytes_of(std::string_view text, bool base64) const;
    // Returns the data of an array, from the XML or the appended section, and whether they are Base64.
    std::pair<std::string_view, bool> data_of(pugi::xml_node node, std::string_view text) const;
    // Returns the raw bytes in `text`, which follow their count.
    std::span<const unsigned char> raw(std::string_view text, std::size_t wanted) const;
    // Returns the same bytes if they are encoded or compressed.
    std::vector<unsigned char> decode(std::string_view text, bool base64, std::size_t wanted) const;
    std::size_t header_number(std::span<const unsigned char> bytes, std::size_t index) const;

    pugi::xml_document document_;
    std::string_view appended_;
    bool appended_base64_ = false, wide_header_ = false, compressed_ = false;
    ByteOrder order_ = ByteOrder::Little;
};

}  // namespace rapid
