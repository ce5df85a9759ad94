// JSON as a text that grows by one value at a time.
//
// Where memory may run out: the destructor of a list or an object of nlohmann's takes memory, and ends the program when
// there is none. Single values are formatted by that library.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace rapid {

class JsonText {
public:
    void begin_object() { begin('{', '}'); }
    void begin_list() { begin('[', ']'); }
    void end()
    {
        text_ += closing_.back();
        closing_.pop_back();
    }

    // The name of the member whose value comes next.
    void key(std::string_view name)
    {
        value(name);
        text_ += ':';
    }

    // A number, a truth value, nullptr or a text; what is no UTF-8 in it is replaced.
    template <class T>
    void value(const T& value)
    {
        separate();
        text_ += nlohmann::json(value).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    }
    template <class T>
    void value(const std::vector<T>& values)
    {
        begin_list();
        for (const T& each : values) value(each);
        end();
    }

    template <class T>
    void member(std::string_view name, const T& of_member)
    {
        key(name);
        value(of_member);
    }

    const std::string& text() const { return text_; }

private:
    void begin(char opening, char closing)
    {
        separate();
        text_ += opening;
        closing_ += closing;
    }
    void separate()
    {
        if (!text_.empty() && std::string_view("{[:").find(text_.back()) == std::string_view::npos) text_ += ',';
    }

    std::string text_;
    std::string closing_;  // of what is open, the innermost last
};

}  // namespace rapid
