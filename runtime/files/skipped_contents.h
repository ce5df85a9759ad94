// Collects the parts of a file that a reader skips, for the caller: a reader can't warn itself.
//
//   SkippedContents skipped;
//   const PointSet points = read_points(path);
//   for (const std::string& what : skipped.list()) ...        the 12 primitives
#pragma once

#include <string>
#include <vector>

namespace rapid {

// Appends to the list unless it is already there. After 20 entries it appends only "more than these 20", so that the
// list fits in a message.
void add_skipped(std::vector<std::string>& list, const std::string& what);

class SkippedContents {
public:
    // Collects everything that readers on this thread skip during its lifetime.
    SkippedContents();
    ~SkippedContents();
    SkippedContents(const SkippedContents&) = delete;
    SkippedContents& operator=(const SkippedContents&) = delete;

    // Called by readers; works like add_skipped(). Does nothing if there is no collector.
    static void add(const std::string& what);

    const std::vector<std::string>& list() const { return list_; }

private:
    std::vector<std::string> list_;
    SkippedContents* outer_;
};

}  // namespace rapid
