#include "bindings/command_line/options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

namespace rapid {

Option Option::type_name(const std::string& name) const { return Option(option_->type_name(name)); }

Option Option::required() const { return Option(option_->required()); }

Option Option::one_value() const { return Option(option_->allow_extra_args(false)); }

Option Option::internal() const { return Option(option_->group("")); }

Option Option::one_of(std::vector<std::string> values) const
{
    return Option(option_->check(CLI::IsMember(std::move(values))));
}

Option Option::excludes(const Option& other) const { return Option(option_->excludes(other.option_)); }

Option Options::add_flag(const std::string& names, bool& value, const std::string& doc)
{
    return Option(app_->add_flag(names, value, doc));
}

Option Options::add_option(const std::string& names, std::string& value, const std::string& doc)
{
    return Option(app_->add_option(names, value, doc));
}

Option Options::add_option(const std::string& names, std::optional<std::string>& value, const std::string& doc)
{
    return Option(app_->add_option(names, value, doc));
}

Option Options::add_option(const std::string& names, std::vector<std::string>& values, const std::string& doc)
{
    return Option(app_->add_option(names, values, doc));
}

Option Options::add_option(const std::string& names, int& value, const std::string& doc)
{
    return Option(app_->add_option(names, value, doc));
}

Option Options::add_option(const std::string& names, std::optional<int>& value, const std::string& doc)
{
    return Option(app_->add_option(names, value, doc));
}

Option Options::add_option(const std::string& names, const std::function<void(const std::string& value)>& read,
                           const std::string& doc)
{
    return Option(app_->add_option_function<std::string>(names, read, doc));
}

Option Options::add_repeated(const std::string& names,
                             const std::function<void(const std::vector<std::string>& values)>& read,
                             const std::string& doc)
{
    return Option(app_->add_option_function<std::vector<std::string>>(names, read, doc));
}

std::vector<std::string> Options::values_of(const std::string& name) const { return app_->get_option(name)->results(); }

std::vector<std::string> Options::words(const std::vector<std::string>& excluded) const
{
    std::vector<std::string> words = {app_->get_name()};
    for (const CLI::Option* option : static_cast<const CLI::App*>(app_)->get_options()) {
        const std::string name = option->get_name(false, false);
        if (option->count() == 0 || std::find(excluded.begin(), excluded.end(), name) != excluded.end()) continue;
        const bool is_flag = option->get_items_expected_max() == 0;
        for (const std::string& value : option->results())
            words.push_back(is_flag ? name : name.starts_with('-') ? fmt::format("{}={}", name, value) : value);
    }
    return words;
}

}  // namespace rapid
