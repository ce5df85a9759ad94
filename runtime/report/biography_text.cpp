// Biographies as text and as JSON.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "runtime/base/json.h"
#include "runtime/graph/evaluation.h"
#include "runtime/report/biography.h"

namespace rapid {
namespace {

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

void add_value(JsonText& json, const AttributeValue& value)
{
    if (const auto* text = std::get_if<Token>(&value)) return json.value(text->text());
    if (const auto* q = std::get_if<Quatf>(&value)) return json.value(q->coeffs());
    std::visit(
        [&]<class T>(const T& x) {
            if constexpr (!std::is_same_v<T, Token> && !std::is_same_v<T, Quatf>) json.value(x);
        },
        value);
}

void add_moment(JsonText& json, const char* name, const std::optional<Biography::Moment>& moment)
{
    if (!moment) return json.member(name, nullptr);
    json.key(name);
    json.object("frame", moment->frame, "time", moment->time, "P", moment->P, "v", moment->v, "node", moment->node,
                "why", moment->why);
}

void add_edit(JsonText& json, const Biography::Edit& edit)
{
    json.begin_object();
    json.member("node", edit.node);
    json.key("changes");
    json.begin_object();
    for (const auto& [name, values] : edit.changes) {
        json.key(name);
        json.object(
            "before", [&, &before = values.first] { add_value(json, before); }, "after",
            [&, &after = values.second] { add_value(json, after); });
    }
    json.end();
    json.member("removed", edit.removed);
    json.end();
}

void add_step(JsonText& json, const Biography::Step& step)
{
    json.begin_object();
    json.members("frame", step.frame, "time", step.time);
    json.key("values");
    if (step.values) {
        json.begin_object();
        for (const auto& [name, value] : *step.values) {
            json.key(name);
            add_value(json, value);
        }
        json.end();
    } else {
        json.value(nullptr);
    }
    json.list("edits", step.edits, [&](const Biography::Edit& edit) { add_edit(json, edit); });
    json.list("forces", step.forces,
              [&](const Biography::Force& force) { json.object("node", force.node, "acceleration", force.a); });
    json.list("contacts", step.contacts, [&](const Biography::Contact& contact) {
        json.object("node", contact.node, "time", contact.time, "P", contact.P, "normal", contact.normal, "speed",
                    contact.speed, "impulse", contact.impulse);
    });
    json.members("asleep", step.asleep, "contacts_known", step.has_contacts);
    json.end();
}

void add_life(JsonText& json, const Biography& life)
{
    json.begin_object();
    json.members("id", life.id, "simulation", life.simulation);
    add_moment(json, "birth", life.birth);
    add_moment(json, "death", life.death);
    json.list("steps", life.steps, [&](const Biography::Step& step) { add_step(json, step); });
    json.end();
}

std::string line_of(std::int64_t frame, double time, const std::string& what)
{
    return fmt::format("  {:>5}  {:>9.5f} s  {}\n", frame, time, what);
}

std::string text_of(const Biography::Edit& edit)
{
    if (edit.removed) return fmt::format("{} drops it from the output", edit.node);
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
    for (const Biography::Edit& edit : step.edits) text += line_of(step.frame, step.time, text_of(edit));
    if (step.asleep != was_asleep) text += line_of(step.frame, step.time, step.asleep ? "sleeps" : "wakes up");
    for (const Biography::Force& force : step.forces)
        text += line_of(step.frame, step.time,
                        fmt::format("{} accelerates it by {} m/s²", force.node, text_of_vector(force.a)));
    for (const Biography::Contact& contact : step.contacts)
        text += line_of(
            step.frame, contact.time,
            fmt::format("meets {} at {}, normal {}, at {:.6g} m/s, impulse {:.6g} kg m/s", contact.node,
                        text_of_vector(contact.P), text_of_vector(contact.normal), contact.speed, contact.impulse));
    if (step.values)
        text += line_of(step.frame, step.time,
                        fmt::format("P = {}, v = {}", text_of(step.values->at("P")), text_of(step.values->at("v"))));
    return text;
}

std::string text_of(const Biography& life)
{
    std::string text = fmt::format("point {} of {}\n", life.id, life.simulation);
    text += line_of(
        life.birth->frame, life.birth->time,
        fmt::format("{} at {}, v = {}", life.birth->why, text_of_vector(life.birth->P), text_of_vector(life.birth->v)));
    bool asleep = false, unknown = false;
    for (const Biography::Step& step : life.steps) {
        text += text_of(step, asleep);
        asleep = step.asleep;
        unknown |= !step.has_contacts;
    }
    if (life.death)
        text += line_of(life.death->frame, life.death->time,
                        fmt::format("dies at {}: {}", text_of_vector(life.death->P), life.death->why));
    if (unknown) text += "  Contacts are unknown: with a tolerance, Solve repeats the step of a point.\n";
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
    JsonText json;
    json.begin_list();
    for (const Biography& life : lives) add_life(json, life);
    json.end();
    return json.text();
}

}  // namespace rapid
