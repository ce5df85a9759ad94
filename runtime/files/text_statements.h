// Text files of one statement per line: Wavefront OBJ, for meshes and points, and the text form of STL.
//
// Lines end with LF, CRLF or CR. A backslash at the end of a line continues the statement on the next one, and a word
// that begins with "#" begins a comment. Errors name the line but not the file; the caller adds it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "runtime/math/vec.h"

namespace rapid {

class TextStatements {
public:
    // `text` must outlive the object.
    explicit TextStatements(std::string_view text) : text_(text) {}

    // Moves to the next statement. Returns false at the end of the file.
    bool next();
    std::string_view keyword() const { return keyword_; }
    std::size_t line() const { return line_; }  // of the current statement, from 1

    // Returns the next word of the statement, or an empty one at its end.
    std::string_view word();
    // Returns the rest of the statement, for names that may contain blanks.
    std::string_view rest_of_line() const;
    // Reads a number. Throws Error if the next word is not one.
    float number();
    Vec3f vector();
    // Parses an index of an OBJ file: from 1, or backwards from the last of the `count` elements so far if negative.
    // Returns it from 0. Throws Error if it is 0, or lies before the first element.
    std::int64_t index(std::string_view word, std::size_t count, std::string_view what = "vertex") const;

private:
    std::string_view text_, rest_, keyword_;
    std::size_t at_ = 0;  // start of the next line
    std::size_t line_ = 0, lines_ = 0;
};

}  // namespace rapid
