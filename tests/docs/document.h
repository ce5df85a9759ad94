// A Markdown document for the tests of documents: its text, headings and inline code.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/test.h"

namespace rapid::test {

inline const std::filesystem::path project = RAPID_SOURCE_DIR;

inline std::string read_text(const std::filesystem::path& file)
{
    std::ifstream in(file);
    REQUIRE(in);
    return {std::istreambuf_iterator<char>(in), {}};
}

// Returns the groups of each match of the pattern; index 0 is the whole match.
inline std::vector<std::vector<std::string>> matches(const std::string& text, const std::regex& pattern)
{
    std::vector<std::vector<std::string>> all;
    for (std::sregex_iterator at(text.begin(), text.end(), pattern), end; at != end; ++at)
        all.emplace_back(at->begin(), at->end());
    return all;
}

// Returns the text without fenced code blocks.
inline std::string without_fenced_code(const std::string& text)
{
    std::string prose;
    bool fenced = false;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size() - 1) + 1;
        const std::string line = text.substr(begin, end - begin);
        begin = end;
        const bool fence = line.rfind("```", 0) == 0;
        if (!fenced && !fence) prose += line;
        fenced ^= fence;
    }
    return prose;
}

struct Section {
    int level;
    std::string title, text;
};

// A section's text ends at the next heading of any level.
inline std::vector<Section> sections(const std::string& text)
{
    std::vector<Section> all;
    std::istringstream lines(without_fenced_code(text));
    for (std::string line; std::getline(lines, line);) {
        const std::size_t level = line.find_first_not_of('#');
        if (level != std::string::npos && level > 0 && line[level] == ' ')
            all.push_back({static_cast<int>(level), line.substr(level + 1), ""});
        else if (!all.empty())
            all.back().text += line + '\n';
    }
    return all;
}

inline std::string section(const std::string& text, const std::string& title)
{
    std::string found;
    int level = 0;
    for (const Section& each : sections(text)) {
        if (level > 0 && each.level <= level) break;
        if (each.title == title) level = each.level;
        if (level > 0) found += each.text;
    }
    return found;
}

// Returns the fragment that links to a heading: lower case, spaces as hyphens, without punctuation.
inline std::string anchor_of(const std::string& title)
{
    std::string anchor;
    for (const char c : title) {
        if (c == ' ')
            anchor += '-';
        else if (std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_')
            anchor += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    return anchor;
}

}  // namespace rapid::test
