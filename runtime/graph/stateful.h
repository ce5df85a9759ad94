// Operators of nodes with state between frames. A node's struct lists all state that later frames depend on in
// serialize() (points/state_archive.h), and creates its operator with stateful():
//
//   static std::unique_ptr<Operator> make() { return stateful<Emit>(); }
//
//   template <class Archive>
//   void serialize(Archive& keep)
//   {
//       keep(clock_, parents_);
//   }
#pragma once

#include <memory>
#include <span>

#include "runtime/graph/node.h"
#include "runtime/points/state_archive.h"

namespace rapid {

// The simulations of a node: its own, and those of its inputs.
struct NodeSimulations {
    Simulation& own;
    std::span<Simulation* const> inputs;
};

class Stateful {
public:
    virtual ~Stateful() = default;

    // Are called between two frames. load() throws Error if the state is of another graph.
    virtual void save(StateWriter& to) const = 0;
    virtual void load(StateReader& from, const NodeSimulations& simulations) = 0;
};

// Calls resume(const NodeSimulations&) of a struct that has it, after loading.
template <class T>
class StatefulOperatorOf final : public detail::OperatorOf<T>, public Stateful {
public:
    void save(StateWriter& to) const override { to(this->node()); }
    void load(StateReader& from, const NodeSimulations& simulations) override
    {
        from(node());
        if constexpr (requires { node().resume(simulations); }) node().resume(simulations);
    }

private:
    T& node() const { return *static_cast<T*>(const_cast<StatefulOperatorOf*>(this)->fields()); }
};

template <class T>
std::unique_ptr<Operator> stateful()
{
    return std::make_unique<StatefulOperatorOf<T>>();
}

}  // namespace rapid
