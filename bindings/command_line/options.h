// The options and arguments of a command, to declare and to read. They hide the parser, CLI11: each file that includes
// it compiles all of it, which takes three seconds.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace rapid {

// One option as it is being declared.
class Option {
public:
    explicit Option(CLI::Option* option) : option_(option) {}

    Option type_name(const std::string& name) const;  // what --help calls its value
    Option required() const;
    Option one_value() const;  // each --NAME takes one value, though the option may be repeated
    Option internal() const;   // --help does not tell it
    Option one_of(std::vector<std::string> values) const;
    Option excludes(const Option& other) const;

private:
    CLI::Option* option_;
};

class Options {
public:
    explicit Options(CLI::App& app) : app_(&app) {}

    Option add_flag(const std::string& names, bool& value, const std::string& doc = "");
    Option add_option(const std::string& names, std::string& value, const std::string& doc = "");
    Option add_option(const std::string& names, std::optional<std::string>& value, const std::string& doc = "");
    Option add_option(const std::string& names, std::vector<std::string>& values, const std::string& doc = "");
    Option add_option(const std::string& names, int& value, const std::string& doc = "");
    Option add_option(const std::string& names, std::optional<int>& value, const std::string& doc = "");
    // What `read` throws is told as an error of usage.
    Option add_option(const std::string& names, const std::function<void(const std::string& value)>& read,
                      const std::string& doc);
    Option add_repeated(const std::string& names,
                        const std::function<void(const std::vector<std::string>& values)>& read,
                        const std::string& doc);

    // The values that were given to an option.
    std::vector<std::string> values_of(const std::string& name) const;

    // The command with its arguments as they were given, but for the options `left_out`.
    std::vector<std::string> words(const std::vector<std::string>& left_out) const;

private:
    CLI::App* app_;
};

}  // namespace rapid
