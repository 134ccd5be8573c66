// SPDX-License-Identifier: BSD-3-Clause
#include "manual.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <functional>
#include <map>
#include <sstream>
#include <string_view>
#include <vector>

#include "command_words.hpp"

namespace tutti::app {
namespace {

using Visit = void(const CLI::App&, const std::string& path);

std::vector<const CLI::Option*> options(const CLI::App& app, bool positional) {
  return app.get_options([positional](const CLI::Option* option) {
    return !option->get_group().empty() && (positional ? option->get_positional() : option->nonpositional());
  });
}

/// Calls `visit` for `app` and what is below it, in the order of --help.
void walk(const CLI::App& app, const std::string& path, const std::function<Visit>& visit) {
  visit(app, path);
  for (const CLI::App* other : shown_commands(app)) walk(*other, path + " " + other->get_name(), visit);
}

/// As groff reads it: nothing of it is a request or an escape, and '-' is the sign that is typed.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (out.empty() && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
  }
  return out;
}

/// --help breaks its lines by hand, long ones for their length: these flow here.
std::string paragraphs(const std::string& text) {
  constexpr std::size_t kLong = 80;
  std::string out;
  std::istringstream in(text);
  bool flows = true;
  for (std::string line; std::getline(in, line);) {
    out += line.empty() ? ".PP\n" : (flows ? "" : ".br\n") + escaped(line) + "\n";
    flows = line.empty() || line.size() >= kLong;
  }
  return out;
}

std::string entries(const std::vector<const CLI::Option*>& options, bool positional) {
  const CLI::Formatter formatter;
  std::string out;
  for (const CLI::Option* option : options)
    out += fmt::format(".TP\n\\fB{}\\fR{}\n{}", escaped(formatter.make_option_name(option, positional)),
                       escaped(formatter.make_option_opts(option)), paragraphs(formatter.make_option_desc(option)));
  return out;
}

std::string of_command(const CLI::App& app, const std::string& path) {
  const CLI::Formatter formatter;
  std::string usage = formatter.make_usage(&app, path);
  usage.erase(0, usage.find(path));
  usage.erase(usage.find_last_not_of('\n') + 1);
  std::string out = fmt::format(".SS {}\n\\fB{}\\fR{}\n.PP\n{}", escaped(path), escaped(path),
                                escaped(usage.substr(path.size())), paragraphs(app.get_description()));
  out += entries(options(app, true), true) + entries(options(app, false), false);
  // CLI11 gives the program's own to every command that has none.
  const std::string footer = app.get_footer();
  if (!footer.empty() && footer != app.get_parent()->get_footer()) out += ".PP\n" + paragraphs(footer);
  return out;
}

/// The words between the braces of what --help shows of an option's values, as of LEVEL:{debug,info}.
std::string choices(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t begin = type.find('{'), end = type.find('}', begin);
  if (begin == std::string::npos || end == std::string::npos) return {};
  std::string out = type.substr(begin + 1, end - begin - 1);
  std::ranges::replace(out, ',', ' ');
  return out;
}

/// How a value of it is completed, in words of the shell: fills COMPREPLY.
std::string completed_value(const CLI::Option& option) {
  if (const std::string words = choices(option); !words.empty()) return fmt::format("_tutti_words '{}'", words);
  const std::string type = option.get_type_name();
  return type == "DIR" || type == "FOLDER" ? "_tutti_folders" : "_tutti_files";
}

/// "--out|-o"
std::string names_of(const CLI::Option& option, const char* between) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  return fmt::format("{}", fmt::join(names, between));
}

/// The case of one command: after an option what it takes, else its options, subcommands, or what a positional is.
std::string completed_command(const CLI::App& app, const std::string& path) {
  std::map<std::string, std::vector<std::string>> values;  // names, by how what follows them is completed
  std::vector<std::string> flags, words;
  for (const CLI::Option* option : options(app, false)) {
    flags.push_back(names_of(*option, " "));
    if (option->get_items_expected_max() > 0) values[completed_value(*option)].push_back(names_of(*option, "|"));
  }
  std::string positional = "_tutti_files";
  const auto places = options(app, true);
  if (!places.empty()) positional = completed_value(*places.front());
  const bool takes_commands = !places.empty() && places.front()->get_type_name() == "COMMAND";  // help
  for (const CLI::App* other : shown_commands(takes_commands ? *app.get_parent() : app))
    words.push_back(other->get_name());
  if (!words.empty()) positional = fmt::format("_tutti_words '{}'", fmt::join(words, " "));
  std::string out = fmt::format("    '{}')\n      case \"$previous\" in\n", path);
  for (const auto& [how, names] : values) out += fmt::format("        {}) {} ;;\n", fmt::join(names, "|"), how);
  return out + fmt::format("        *) _tutti_flags '{}' || {} ;;\n      esac ;;\n", fmt::join(flags, " "), positional);
}

}  // namespace

std::string manual_page(const CLI::App& program, const std::string& version) {
  const std::string name = program.get_name(), text = program.get_description();
  const std::size_t begin = text.find(": ") + 2, end = text.find(".\n");  // "tutti: what it is in a line.\n and more"
  std::string title = name;
  std::ranges::transform(title, title.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  std::string out = fmt::format(".TH {} 1 \"\" \"{} {}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n", title, name,
                                version, name, escaped(text.substr(begin, end - begin)));
  out += fmt::format(".SH SYNOPSIS\n\\fB{}\\fR COMMAND [OPTIONS] ...\n", name);
  out += ".SH DESCRIPTION\n" + paragraphs(text.substr(end + 2));
  out += ".SH OPTIONS\n" + entries(options(program, false), false);
  out += ".SH COMMANDS\n";
  walk(program, name, [&](const CLI::App& app, const std::string& path) {
    if (&app != &program) out += of_command(app, path);
  });
  return out + ".SH EXIT STATUS\n" + paragraphs(program.get_footer());
}

std::string bash_completion(const CLI::App& program) {
  std::string paths, cases;
  walk(program, program.get_name(), [&](const CLI::App& app, const std::string& path) {
    if (&app != &program) paths += (paths.empty() ? "'" : "|'") + path + "'";
    cases += completed_command(app, path);
  });
  return fmt::format(R"(# Completion of {0} for bash, made by: {0} manual bash
_tutti_words() {{ mapfile -t COMPREPLY < <(compgen -W "$1" -- "$current"); }}
_tutti_flags() {{ [[ $current == -* ]] && _tutti_words "$1"; }}
_tutti_folders() {{ compopt -o filenames 2>/dev/null; mapfile -t COMPREPLY < <(compgen -d -- "$current"); }}
_tutti_files() {{ compopt -o filenames 2>/dev/null; mapfile -t COMPREPLY < <(compgen -f -- "$current"); }}
_tutti() {{
  local current="${{COMP_WORDS[COMP_CWORD]}}" previous="${{COMP_WORDS[COMP_CWORD - 1]}}" path={0} i
  COMPREPLY=()
  for ((i = 1; i < COMP_CWORD; i++)); do
    case "$path ${{COMP_WORDS[i]}}" in
      {1}) path+=" ${{COMP_WORDS[i]}}" ;;
    esac
  done
  # --option=value is three words to bash.
  if [[ $current == = ]]; then
    current=
  elif [[ $previous == = ]]; then
    previous="${{COMP_WORDS[COMP_CWORD - 2]}}"
  fi
  case "$path" in
{2}  esac
}}
complete -F _tutti {0}
)",
                     program.get_name(), paths, cases);
}

}  // namespace tutti::app
