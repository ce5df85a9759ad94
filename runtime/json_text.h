// JSON as a text that grows by one value at a time: the way in which all of Rapid writes it.
//
//   JsonText json;
//   json.object("frame", 3, "P", std::array{0.0, 1.0, 2.0}, "error", nullptr);
//
// It holds no tree of values, because memory may run out: the destructor of a list or an object of nlohmann's
// allocates, and ends the program if it can't. That library formats single values.
#pragma once

#include <concepts>
#include <optional>
#include <ranges>
#include <string>
#include <string_view>
#include <variant>

#include "runtime/checked_json.h"

namespace rapid {

class JsonText {
public:
    // With an indent (in spaces a level) each member and element has a line of its own.
    explicit JsonText(std::size_t indent = 0) : indent_(indent) {}

    void begin_object() { begin('{', '}'); }
    void begin_list() { begin('[', ']'); }
    void end()
    {
        const char closing = closing_.back();
        closing_.pop_back();
        if (!is_empty()) new_line();
        text_ += closing;
    }

    // The name of the member whose value comes next.
    void key(std::string_view name)
    {
        value(name);
        text_ += indent_ > 0 ? ": " : ":";
    }

    // A number, a truth value, nullptr or a string, whose bytes that are no UTF-8 are replaced; an optional or a
    // variant of these; a map with names, a list, or parsed JSON. A function is called to write the value.
    template <class T>
    void value(const T& value)
    {
        if constexpr (std::invocable<const T&>) {
            value();
        } else if constexpr (nlohmann::detail::is_basic_json<T>::value) {
            add_parsed(value);
        } else if constexpr (requires { value.valueless_by_exception(); }) {
            std::visit([this](const auto& held) { this->value(held); }, value);
        } else if constexpr (requires {
                                 value.has_value();
                                 *value;
                             }) {
            value ? this->value(*value) : this->value(nullptr);
        } else if constexpr (requires { typename T::mapped_type; }) {
            begin_object();
            for (const auto& [name, of_member] : value) members(name, of_member);
            end();
        } else if constexpr (std::ranges::range<T> && !std::convertible_to<T, std::string_view>) {
            begin_list();
            for (const auto& each : value) this->value(each);
            end();
        } else {
            add_single(nlohmann::json(value));
        }
    }

    // Members of the object that is open: names and values in turn.
    template <class T, class... Rest>
    void members(std::string_view name, const T& of_member, const Rest&... rest)
    {
        key(name);
        value(of_member);
        if constexpr (sizeof...(Rest) > 0) members(rest...);
    }
    template <class T>
    void member(std::string_view name, const T& of_member)
    {
        members(name, of_member);
    }
    template <class... Members>
    void object(const Members&... all)
    {
        begin_object();
        if constexpr (sizeof...(Members) > 0) members(all...);
        end();
    }
    // A member that is a list. `add` writes each element.
    template <class Range, class F>
    void list(std::string_view name, const Range& range, const F& add)
    {
        key(name);
        begin_list();
        for (const auto& each : range) add(each);
        end();
    }

    const std::string& text() const { return text_; }

private:
    void begin(char opening, char closing)
    {
        separate();
        text_ += opening;
        closing_ += closing;
    }
    // A list or an object that has just been begun.
    bool is_empty() const { return text_.back() == '{' || text_.back() == '['; }
    void new_line()
    {
        if (indent_ > 0) text_.append(1, '\n').append(indent_ * closing_.size(), ' ');
    }
    void separate()
    {
        if (closing_.empty() || text_.back() == ':' || text_.back() == ' ') return;  // a key has no other end
        if (!is_empty()) text_ += ',';
        new_line();
    }
    template <class Json>
    void add_single(const Json& single)
    {
        separate();
        text_ += single.dump(-1, ' ', false, Json::error_handler_t::replace);
    }
    template <class Json>
    void add_parsed(const Json& parsed)
    {
        if (!parsed.is_structured()) return add_single(parsed);
        parsed.is_object() ? begin_object() : begin_list();
        for (const auto& each : parsed.items()) {
            if (parsed.is_object()) key(each.key());
            add_parsed(each.value());
        }
        end();
    }

    const std::size_t indent_;
    std::string text_;
    std::string closing_;  // of what is open, the innermost last
};

// A value as a text of its own.
template <class T>
std::string json_text(const T& value, std::size_t indent = 0)
{
    JsonText json(indent);
    json.value(value);
    return json.text();
}

}  // namespace rapid
