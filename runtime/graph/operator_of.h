// Turns a node's struct into an Operator, using its member functions (listed in node.h).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <utility>

#include "runtime/graph/node_type.h"
#include "runtime/solver/dynamics.h"

namespace rapid {

namespace detail {

// The force of a node whose struct has contribute() or uniform().
template <class T>
class ForceOf : public Force {
public:
    explicit ForceOf(const T& fields) : fields_(fields) {}
    void contribute(const Chunk& chunk, Forces& forces) const override
    {
        if constexpr (requires { fields_.contribute(chunk, forces); })
            fields_.contribute(chunk, forces);
        else
            forces.add(*fields_.uniform());
    }
    std::optional<Uniform> uniform() const override
    {
        if constexpr (requires { fields_.uniform(); })
            return fields_.uniform();
        else
            return std::nullopt;
    }
    bool add_potential(const Chunk& chunk, std::span<double> energy) const override
    {
        if constexpr (requires { fields_.add_potential(chunk, energy); })
            return fields_.add_potential(chunk, energy);
        else
            return Force::add_potential(chunk, energy);
    }

private:
    T fields_;
};

template <class T>
constexpr bool is_force = requires(const T& t, const Chunk& chunk, Forces& forces)
{
    t.contribute(chunk, forces);
}
|| requires(const T& t) { t.uniform(); };
template <class T>
constexpr bool has_dynamic = requires(const T& t, const Evaluation& now)
{
    t.dynamic(now);
};
template <class T>
constexpr bool has_edit = requires(T& t, PointSet& points, const Evaluation& now)
{
    t.edit(points, now);
};

// The operator of a node whose struct has edit(), contribute(), uniform(), dynamic() or evaluate().
template <class T>
class OperatorOf : public Operator {
public:
    void* fields() override { return &fields_; }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now) override
    {
        if constexpr (has_edit<T>) {
            fields_.edit(inputs[0].points, now);
            return std::move(inputs[0]);
        } else if constexpr (is_force<T> || has_dynamic<T>) {
            if (auto made = dynamic(now)) inputs[0].dynamics.add(std::move(made));
            return std::move(inputs[0]);
        } else {
            return fields_.evaluate(inputs, now);
        }
    }

    Flow start(std::span<Flow> inputs, const Evaluation& now) override
    {
        if constexpr (requires { fields_.start(inputs, now); })
            return fields_.start(inputs, now);
        else
            return std::move(inputs[0]);
    }

    void uses(Uses& uses) const override
    {
        if constexpr (requires { fields_.group; })
            if (!fields_.group.empty()) uses.reads_groups.push_back(fields_.group);
        if constexpr (requires { fields_.uses(uses); }) fields_.uses(uses);
    }

    void check() const override
    {
        if constexpr (requires { fields_.check(); }) fields_.check();
    }

private:
    auto dynamic(const Evaluation& now) const
    {
        if constexpr (has_dynamic<T>) {
            return fields_.dynamic(now);
        } else {
            std::string group;
            if constexpr (requires { fields_.group; }) group = fields_.group;
            return dynamic_of<ForceOf<T>>(now, group, fields_);
        }
    }

    T fields_{};
};

}  // namespace detail

}  // namespace rapid
