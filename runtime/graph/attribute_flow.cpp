#include "runtime/graph/attribute_flow.h"

namespace rapid {
namespace {

constexpr std::size_t word_bits = 64;

// Whether this adds anything.
bool add_all(std::vector<std::uint64_t>& names, const std::vector<std::uint64_t>& others)
{
    bool grows = false;
    for (std::size_t k = 0; k < names.size(); ++k) {
        grows |= (others[k] & ~names[k]) != 0;
        names[k] |= others[k];
    }
    return grows;
}

}  // namespace

AttributeFlow::AttributeFlow(const std::vector<PlannedNode>& nodes)
{
    std::vector<std::vector<std::size_t>> made(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i)
        for (const AttributeSpec& spec : uses_of(nodes[i]).makes)
            made[i].push_back(names_.emplace(spec.name, names_.size()).first->second);
    const Names none((names_.size() + word_bits - 1) / word_bits, 0);

    at_.assign(nodes.size(), none);
    std::map<std::size_t, Names> fed_back;  // by simulation
    // Points that a merge brings into a loop come back with what they have, so the names go round until they settle.
    for (bool grows = true; grows;) {
        grows = false;
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            const PlannedNode& planned = nodes[i];
            for (const std::size_t name : made[i]) at_[i][name / word_bits] |= std::uint64_t{1} << name % word_bits;
            for (const std::size_t input : planned.inputs) add_all(at_[i], at_[input]);
            Names& back = fed_back.emplace(planned.simulation, none).first->second;
            if (planned.node->type->kind == NodeKind::Source) add_all(at_[i], back);
            if (planned.node->type->kind == NodeKind::Solve) grows |= add_all(back, at_[i]);
        }
    }
}

bool AttributeFlow::has(std::size_t node, std::string_view name) const
{
    const auto known = names_.find(name);
    return known != names_.end() && (at_[node][known->second / word_bits] >> known->second % word_bits & 1) != 0;
}

std::vector<std::string> AttributeFlow::names_at(std::size_t node) const
{
    std::vector<std::string> names;
    for (const auto& [name, bit] : names_)
        if (has(node, name)) names.push_back(name);
    return names;
}

}  // namespace rapid
