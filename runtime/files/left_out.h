// Collects the parts of a file that a reader skips, for the caller: a reader can't warn itself.
//
//   LeftOut left_out;
//   const PointSet points = read_points(path);
//   for (const std::string& what : left_out.list()) ...        the 12 primitives
#pragma once

#include <string>
#include <vector>

namespace rapid {

// Appends to the list unless it is already there. After 20 entries it appends only "more than these 20", so that the
// list fits in a message.
void add_left_out(std::vector<std::string>& list, const std::string& what);

class LeftOut {
public:
    // Collects everything that readers on this thread skip during its lifetime.
    LeftOut();
    ~LeftOut();
    LeftOut(const LeftOut&) = delete;
    LeftOut& operator=(const LeftOut&) = delete;

    // Called by readers; works like add_left_out(). Does nothing if there is no collector.
    static void add(const std::string& what);

    const std::vector<std::string>& list() const { return list_; }

private:
    std::vector<std::string> list_;
    LeftOut* outer_;
};

}  // namespace rapid
