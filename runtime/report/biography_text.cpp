// Biographies as text and as JSON.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "runtime/graph/evaluation.h"
#include "runtime/report/biography.h"

namespace rapid {
namespace {

using nlohmann::ordered_json;

template <class V>
std::string text_of_vector(const V& x)
{
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", x.x(), x.y(), x.z());
}

std::string text_of(const AttributeValue& value)
{
    if (const auto* x = std::get_if<float>(&value)) return fmt::format("{:.6g}", *x);
    if (const auto* x = std::get_if<Vec3f>(&value)) return text_of_vector(*x);
    if (const auto* x = std::get_if<std::int32_t>(&value)) return std::to_string(*x);
    if (const auto* x = std::get_if<std::int64_t>(&value)) return std::to_string(*x);
    if (const auto* x = std::get_if<Token>(&value)) return fmt::format("\"{}\"", x->text());
    const Quatf& q = std::get<Quatf>(value);
    return fmt::format("({:.6g}, {:.6g}, {:.6g}, {:.6g})", q.x(), q.y(), q.z(), q.w());
}

template <class V>
ordered_json json_of_vector(const V& x)
{
    return {x.x(), x.y(), x.z()};
}

ordered_json json_of(const AttributeValue& value)
{
    if (const auto* x = std::get_if<float>(&value)) return *x;
    if (const auto* x = std::get_if<Vec3f>(&value)) return json_of_vector(*x);
    if (const auto* x = std::get_if<std::int32_t>(&value)) return *x;
    if (const auto* x = std::get_if<std::int64_t>(&value)) return *x;
    if (const auto* x = std::get_if<Token>(&value)) return std::string(x->text());
    const Quatf& q = std::get<Quatf>(value);
    return {q.x(), q.y(), q.z(), q.w()};
}

ordered_json json_of(const std::optional<Biography::Moment>& moment)
{
    if (!moment) return nullptr;
    return {{"frame", moment->frame},         {"time", moment->time}, {"P", json_of_vector(moment->P)},
            {"v", json_of_vector(moment->v)}, {"node", moment->node}, {"why", moment->why}};
}

ordered_json json_of(const Biography::Step& step)
{
    ordered_json edits = ordered_json::array(), forces = ordered_json::array(), contacts = ordered_json::array();
    for (const Biography::Edit& edit : step.edits) {
        ordered_json changes = ordered_json::object();
        for (const auto& [name, values] : edit.changes)
            changes[name] = {{"before", json_of(values.first)}, {"after", json_of(values.second)}};
        edits.push_back({{"node", edit.node}, {"changes", changes}, {"removed", edit.removed}});
    }
    for (const Biography::Force& force : step.forces)
        forces.push_back({{"node", force.node}, {"acceleration", json_of_vector(force.a)}});
    for (const Biography::Contact& contact : step.contacts)
        contacts.push_back({{"node", contact.node},
                            {"time", contact.time},
                            {"P", json_of_vector(contact.P)},
                            {"normal", json_of_vector(contact.normal)},
                            {"speed", contact.speed},
                            {"impulse", contact.impulse}});
    ordered_json values = nullptr;
    if (step.values) {
        values = ordered_json::object();
        for (const auto& [name, value] : *step.values) values[name] = json_of(value);
    }
    return {
        {"frame", step.frame}, {"time", step.time},    {"values", values},      {"edits", edits},
        {"forces", forces},    {"contacts", contacts}, {"asleep", step.asleep}, {"contacts_known", step.has_contacts}};
}

std::string line(std::int64_t frame, double time, const std::string& what)
{
    return fmt::format("  {:>5}  {:>9.5f} s  {}\n", frame, time, what);
}

std::string text_of(const Biography::Edit& edit)
{
    if (edit.removed) return fmt::format("{} leaves it out of the output", edit.node);
    std::vector<std::string> changes;
    for (const auto& [name, values] : edit.changes)
        changes.push_back(text_of(values.first) == text_of(values.second)
                              ? fmt::format("{} = {}", name, text_of(values.second))
                              : fmt::format("{} {} -> {}", name, text_of(values.first), text_of(values.second)));
    return fmt::format("{}: {}", edit.node, fmt::join(changes, ", "));
}

std::string text_of(const Biography::Step& step, bool was_asleep)
{
    std::string text;
    for (const Biography::Edit& edit : step.edits) text += line(step.frame, step.time, text_of(edit));
    if (step.asleep != was_asleep) text += line(step.frame, step.time, step.asleep ? "sleeps" : "is awake again");
    for (const Biography::Force& force : step.forces)
        text += line(step.frame, step.time,
                     fmt::format("{} accelerates it by {} m/s²", force.node, text_of_vector(force.a)));
    for (const Biography::Contact& contact : step.contacts)
        text += line(
            step.frame, contact.time,
            fmt::format("meets {} at {}, normal {}, at {:.6g} m/s, impulse {:.6g} kg m/s", contact.node,
                        text_of_vector(contact.P), text_of_vector(contact.normal), contact.speed, contact.impulse));
    if (step.values)
        text += line(step.frame, step.time,
                     fmt::format("P = {}, v = {}", text_of(step.values->at("P")), text_of(step.values->at("v"))));
    return text;
}

std::string text_of(const Biography& life)
{
    std::string text = fmt::format("point {} of {}\n", life.id, life.simulation);
    text += line(
        life.birth->frame, life.birth->time,
        fmt::format("{} at {}, v = {}", life.birth->why, text_of_vector(life.birth->P), text_of_vector(life.birth->v)));
    bool asleep = false, unknown = false;
    for (const Biography::Step& step : life.steps) {
        text += text_of(step, asleep);
        asleep = step.asleep;
        unknown |= !step.has_contacts;
    }
    if (life.death)
        text += line(life.death->frame, life.death->time,
                     fmt::format("dies at {}: {}", text_of_vector(life.death->P), life.death->why));
    if (unknown)
        text += "  Contacts are not known: with a tolerance Solve takes a point through a step several times.\n";
    return text;
}

}  // namespace

std::string to_text(const std::vector<Biography>& lives)
{
    std::string text;
    for (const Biography& life : lives) text += text_of(life);
    return text;
}

std::string to_json(const std::vector<Biography>& lives)
{
    ordered_json json = ordered_json::array();
    for (const Biography& life : lives) {
        ordered_json steps = ordered_json::array();
        for (const Biography::Step& step : life.steps) steps.push_back(json_of(step));
        json.push_back({{"id", life.id},
                        {"simulation", life.simulation},
                        {"birth", json_of(life.birth)},
                        {"death", json_of(life.death)},
                        {"steps", steps}});
    }
    return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace rapid
