// The options and arguments of a command, to declare and to read. They hide the parser, CLI11, since each file that
// includes it takes three seconds to compile.
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

// An option that is being declared.
class Option {
public:
    explicit Option(CLI::Option* option) : option_(option) {}

    Option type_name(const std::string& name) const;  // the name of its value in --help
    Option required() const;
    Option one_value() const;  // each --NAME takes one value, even if the option may be repeated
    Option internal() const;   // hidden from --help
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
    // Reports exceptions of `read` as usage errors.
    Option add_option(const std::string& names, const std::function<void(const std::string& value)>& read,
                      const std::string& doc);
    Option add_repeated(const std::string& names,
                        const std::function<void(const std::vector<std::string>& values)>& read,
                        const std::string& doc);

    // Returns the values given to an option.
    std::vector<std::string> values_of(const std::string& name) const;

    // Returns the command with its arguments as given, without the options `excluded`.
    std::vector<std::string> words(const std::vector<std::string>& excluded) const;

private:
    CLI::App* app_;
};

}  // namespace rapid
