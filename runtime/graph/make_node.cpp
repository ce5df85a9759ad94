#include "runtime/graph/make_node.h"

#include <new>
#include <vector>

namespace rapid {
namespace {

// Those that the outermost end() of this thread has still to delete.
thread_local std::vector<Node*>* waiting = nullptr;

void end(Node* node)
{
    if (waiting) try {
            return waiting->push_back(node);
        } catch (const std::bad_alloc&) {  // then within its destructor
        }
    if (waiting) return delete node;
    std::vector<Node*> nodes;
    waiting = &nodes;
    for (delete node; !nodes.empty();) {
        Node* const next = nodes.back();
        nodes.pop_back();
        delete next;
    }
    waiting = nullptr;
}

}  // namespace

std::shared_ptr<Node> make_node(const Node& node) { return {new Node(node), end}; }

}  // namespace rapid
