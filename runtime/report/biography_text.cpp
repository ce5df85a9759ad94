// Biographies as text and as JSON.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "runtime/graph/evaluation.h"
#include "runtime/json_text.h"
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

template <class V>
std::vector<typename V::Scalar> numbers_of(const V& x)
{
    return {x.x(), x.y(), x.z()};
}

void add_json(JsonText& json, const AttributeValue& value)
{
    if (const auto* x = std::get_if<float>(&value)) return json.value(*x);
    if (const auto* x = std::get_if<Vec3f>(&value)) return json.value(numbers_of(*x));
    if (const auto* x = std::get_if<std::int32_t>(&value)) return json.value(*x);
    if (const auto* x = std::get_if<std::int64_t>(&value)) return json.value(*x);
    if (const auto* x = std::get_if<Token>(&value)) return json.value(std::string(x->text()));
    const Quatf& q = std::get<Quatf>(value);
    json.value(std::vector{q.x(), q.y(), q.z(), q.w()});
}

void add_json(JsonText& json, const std::optional<Biography::Moment>& moment)
{
    if (!moment) return json.value(nullptr);
    json.begin_object();
    json.member("frame", moment->frame);
    json.member("time", moment->time);
    json.member("P", numbers_of(moment->P));
    json.member("v", numbers_of(moment->v));
    json.member("node", moment->node);
    json.member("why", moment->why);
    json.end();
}

void add_json(JsonText& json, const Biography::Edit& edit)
{
    json.begin_object();
    json.member("node", edit.node);
    json.key("changes");
    json.begin_object();
    for (const auto& [name, values] : edit.changes) {
        json.key(name);
        json.begin_object();
        json.key("before");
        add_json(json, values.first);
        json.key("after");
        add_json(json, values.second);
        json.end();
    }
    json.end();
    json.member("removed", edit.removed);
    json.end();
}

void add_json(JsonText& json, const Biography::Force& force)
{
    json.begin_object();
    json.member("node", force.node);
    json.member("acceleration", numbers_of(force.a));
    json.end();
}

void add_json(JsonText& json, const Biography::Contact& contact)
{
    json.begin_object();
    json.member("node", contact.node);
    json.member("time", contact.time);
    json.member("P", numbers_of(contact.P));
    json.member("normal", numbers_of(contact.normal));
    json.member("speed", contact.speed);
    json.member("impulse", contact.impulse);
    json.end();
}

void add_json(JsonText& json, const Biography::Step& step);

template <class T>
void add_list(JsonText& json, const char* name, const std::vector<T>& all)
{
    json.key(name);
    json.begin_list();
    for (const T& one : all) add_json(json, one);
    json.end();
}

void add_json(JsonText& json, const Biography::Step& step)
{
    json.begin_object();
    json.member("frame", step.frame);
    json.member("time", step.time);
    json.key("values");
    if (step.values) {
        json.begin_object();
        for (const auto& [name, value] : *step.values) {
            json.key(name);
            add_json(json, value);
        }
        json.end();
    } else {
        json.value(nullptr);
    }
    add_list(json, "edits", step.edits);
    add_list(json, "forces", step.forces);
    add_list(json, "contacts", step.contacts);
    json.member("asleep", step.asleep);
    json.member("contacts_known", step.has_contacts);
    json.end();
}

void add_json(JsonText& json, const Biography& life)
{
    json.begin_object();
    json.member("id", life.id);
    json.member("simulation", life.simulation);
    json.key("birth");
    add_json(json, life.birth);
    json.key("death");
    add_json(json, life.death);
    add_list(json, "steps", life.steps);
    json.end();
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
    JsonText json;
    json.begin_list();
    for (const Biography& life : lives) add_json(json, life);
    json.end();
    return json.text();
}

}  // namespace rapid
