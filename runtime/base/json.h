// JSON as Rapid reads and writes it: CheckedJson and SortedCheckedJson for parsed values, JsonText for strings.
#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <ranges>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

namespace rapid {

// Converts JSON to numbers, with checks. With nlohmann's own types, a number that is too large for the requested type
// becomes an arbitrary one: 4294967297 becomes the int 1, and 1e30 is undefined.
template <class T, class = void>
struct CheckedNumber : nlohmann::adl_serializer<T> {
};

// Integers, including enumerations. Throws json::type_error if the value is not a number, has a fraction, or is out of
// T's range.
template <class T>
struct CheckedNumber<T, std::enable_if_t<(std::is_integral_v<T> && !std::is_same_v<T, bool>) || std::is_enum_v<T>>> {
    template <class Json>
    static void to_json(Json& json, T value)
    {
        nlohmann::to_json(json, value);
    }

    template <class Json>
    static void from_json(const Json& json, T& value)
    {
        if constexpr (std::is_enum_v<T>) {
            value = static_cast<T>(json.template get<std::underlying_type_t<T>>());
        } else {
            const auto refuse = [&](const std::string& what) {
                throw nlohmann::json::type_error::create(302, what + json.dump(), &json);
            };
            // Every integer of T lies in [-2^digits, 2^digits), whose ends a double can represent.
            const double beyond = std::ldexp(1.0, std::numeric_limits<T>::digits);
            const double least = std::is_signed_v<T> ? -beyond : 0.0;
            if (json.is_number_unsigned()) {
                const auto number = json.template get_ref<const typename Json::number_unsigned_t&>();
                if (!std::in_range<T>(number)) refuse("an integer is out of range: ");
                value = static_cast<T>(number);
            } else if (json.is_number_integer()) {
                const auto number = json.template get_ref<const typename Json::number_integer_t&>();
                if (!std::in_range<T>(number)) refuse("an integer is out of range: ");
                value = static_cast<T>(number);
            } else if (json.is_number_float()) {
                const double number = json.template get_ref<const typename Json::number_float_t&>();
                if (!(number >= least && number < beyond)) refuse("an integer is out of range: ");
                if (number != std::trunc(number)) refuse("must be an integer: ");
                value = static_cast<T>(number);
            } else {
                throw nlohmann::json::type_error::create(302, std::string("must be a number, is ") + json.type_name(),
                                                         &json);
            }
        }
    }
};

// JSON whose members keep their order.
using CheckedJson = nlohmann::basic_json<nlohmann::ordered_map, std::vector, std::string, bool, std::int64_t,
                                         std::uint64_t, double, std::allocator, CheckedNumber>;
// JSON with members sorted by name, for files from elsewhere: finding a member of an object of n takes log n.
using SortedCheckedJson = nlohmann::basic_json<std::map, std::vector, std::string, bool, std::int64_t, std::uint64_t,
                                               double, std::allocator, CheckedNumber>;

// Builds JSON as a string, one value at a time. All of Rapid writes JSON through it.
//
//   JsonText json;
//   json.object("frame", 3, "P", std::array{0.0, 1.0, 2.0}, "error", nullptr);
//
// It builds no tree of values, because memory may run out: nlohmann's destructor of a list or an object allocates, and
// terminates the program if that fails. That library formats single values.
class JsonText {
public:
    // indent: spaces per level. If it is not 0, each member and element gets its own line.
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

    // Writes the name of the member whose value comes next.
    void key(std::string_view name)
    {
        value(name);
        text_ += indent_ > 0 ? ": " : ":";
    }

    // Writes a number, bool, nullptr or string (replacing invalid UTF-8), an optional or a variant of these, a map with
    // string keys, a list, or parsed JSON. A function is called and must write the value itself.
    template <class T>
    void value(const T& value)
    {
        if constexpr (std::invocable<const T&>) {
            value();
        } else if constexpr (nlohmann::detail::is_basic_json<T>::value) {
            add(value);
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
            add(nlohmann::json(value));
        }
    }

    // Writes a value that is JSON already.
    void written(std::string_view json)
    {
        separate();
        text_ += json;
    }

    // Writes members of the open object. The arguments alternate between names and values.
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
    // Writes the members of a parsed object.
    void add_members(const CheckedJson& object)
    {
        for (const auto& each : object.items()) member(each.key(), each.value());
    }
    // Writes a member that is a list. `add` writes each element.
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
    // Returns true if the innermost list or object has no content yet.
    bool is_empty() const { return text_.back() == '{' || text_.back() == '['; }
    void new_line()
    {
        if (indent_ > 0) text_.append(1, '\n').append(indent_ * closing_.size(), ' ');
    }
    void separate()
    {
        if (closing_.empty() || text_.back() == ':' || text_.back() == ' ') return;  // only keys end like this
        if (!is_empty()) text_ += ',';
        new_line();
    }
    template <class Json>
    void add(const Json& json)
    {
        separate();
        for (const char c :
             json.dump(indent_ > 0 ? static_cast<int>(indent_) : -1, ' ', false, Json::error_handler_t::replace)) {
            text_ += c;
            if (c == '\n') text_.append(indent_ * closing_.size(), ' ');
        }
    }

    const std::size_t indent_;
    std::string text_;
    std::string closing_;  // closing brackets of the open values, innermost last
};

// Returns a value as a complete JSON string.
template <class T>
std::string json_text(const T& value, std::size_t indent = 0)
{
    JsonText json(indent);
    json.value(value);
    return json.text();
}

}  // namespace rapid
