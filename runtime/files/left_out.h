// What readers of files leave out, for those who called them: a reader can't warn by itself.
//
//   LeftOut left_out;
//   const PointSet points = read_points(path);
//   for (const std::string& what : left_out.list()) ...        the 12 primitives
#pragma once

#include <string>
#include <vector>

namespace rapid {

// To such a list, once for the same, and no more than fit in a message: further ones are "more than these 20".
void add_left_out(std::vector<std::string>& list, const std::string& what);

class LeftOut {
public:
    // Collects what is left out on this thread from now on, until it is destroyed.
    LeftOut();
    ~LeftOut();
    LeftOut(const LeftOut&) = delete;
    LeftOut& operator=(const LeftOut&) = delete;

    // Of a reader, as add_left_out. Lost where nobody collects.
    static void add(const std::string& what);

    const std::vector<std::string>& list() const { return list_; }

private:
    std::vector<std::string> list_;
    LeftOut* outer_;
};

}  // namespace rapid
