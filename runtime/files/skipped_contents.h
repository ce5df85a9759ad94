// Collects what a reader has to say about a file, for the caller: a reader can't warn itself.
//
//   SkippedContents skipped;
//   const PointSet points = read_points(path);
//   for (const std::string& what : skipped.list()) ...        not read: its 12 primitives
#pragma once

#include <string>
#include <vector>

namespace rapid {

// Appends a clause to the list unless it is already there. After 20 entries it appends only "there is more than these
// 20 notes", so that the list fits in a message.
void add_note(std::vector<std::string>& list, const std::string& clause);
// Appends the clause that WHAT is skipped.
void add_skipped(std::vector<std::string>& list, const std::string& what);

// The note on a text file that may be cut.
constexpr const char* no_last_newline = "its last line has no newline, so that its last number may be cut short";

class SkippedContents {
public:
    // Collects all notes of readers on this thread during its lifetime.
    SkippedContents();
    ~SkippedContents();
    SkippedContents(const SkippedContents&) = delete;
    SkippedContents& operator=(const SkippedContents&) = delete;

    // Called by readers; work like add_skipped() and add_note(). Do nothing if there is no collector.
    static void add(const std::string& what);
    static void note(const std::string& clause);

    const std::vector<std::string>& list() const { return list_; }

private:
    std::vector<std::string> list_;
    SkippedContents* outer_;
};

}  // namespace rapid
