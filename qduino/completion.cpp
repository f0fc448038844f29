#include "qduino/completion.h"

#include <algorithm>
#include <vector>

#include "base/text.h"
#include "terminal/parser.h"

namespace qduino::apps {
namespace {

struct Flag {
    std::vector<std::string> names;  ///< "-o", "--output"
    std::string description;
    bool takes_value = false;
};

std::vector<Flag> flags_of(const CLI::App& app) {
    std::vector<Flag> flags;
    for (const CLI::Option* option : app.get_options()) {
        if (option->get_positional()) continue;
        Flag flag{.names = {}, .description = option->get_description(), .takes_value = false};
        for (const std::string& name : option->get_snames()) flag.names.push_back("-" + name);
        for (const std::string& name : option->get_lnames()) flag.names.push_back("--" + name);
        flag.takes_value = option->get_items_expected_max() > 0;
        if (flag.description.starts_with("Print this help")) flag.description = "Print help";
        flags.push_back(flag);
    }
    return flags;
}

/// A sketch, a name, or a command.
bool takes_files(const CLI::App& command) {
    return command.get_name() == "vcpu" ||
           std::ranges::any_of(command.get_options(), [](const CLI::Option* option) {
               return option->get_positional() && option->get_name() != "shell";
           });
}

std::string names_of(const std::vector<Flag>& flags) {
    std::string names;
    for (const Flag& flag : flags) {
        for (const std::string& name : flag.names) names += (names.empty() ? "" : " ") + name;
    }
    return names;
}

std::string bash_script(const CLI::App& parser) {
    std::string commands, cases;
    for (const CLI::App* command : parser.get_subcommands({})) {
        write(commands, commands.empty() ? "" : " ", command->get_name());
        write(cases, "    ", command->get_name(), ") flags=\"", names_of(flags_of(*command)), "\" ;;\n");
    }
    return "# bash completion for qduino\n"
           "_qduino() {\n"
           "  local word=${COMP_WORDS[COMP_CWORD]} flags=\"\"\n"
           "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
           "    COMPREPLY=($(compgen -W \"" +
           commands + " " + names_of(flags_of(parser)) +
           "\" -- \"$word\"))\n"
           "    return\n"
           "  fi\n"
           "  case ${COMP_WORDS[COMP_CWORD-1]} in\n"
           "    --only) COMPREPLY=($(compgen -W \"sim linux\" -- \"$word\")); return ;;\n"
           "    completion) COMPREPLY=($(compgen -W \"bash zsh fish\" -- \"$word\")); return ;;\n"
           "  esac\n"
           "  case ${COMP_WORDS[1]} in\n" +
           cases +
           "  esac\n"
           "  if [[ $word == -* ]]; then\n"
           "    COMPREPLY=($(compgen -W \"$flags\" -- \"$word\"))\n"
           "  else\n"
           "    COMPREPLY=($(compgen -f -- \"$word\"))\n"
           "  fi\n"
           "}\n"
           "complete -o filenames -F _qduino qduino\n";
}

/// For between single quotes, in zsh's _arguments and in fish.
std::string quoted(const std::string& text, bool zsh) {
    std::string out;
    for (const char c : text) {
        if (c == '\'') {
            out += "'\\''";
        } else if (zsh && (c == '[' || c == ']' || c == ':')) {
            out += std::string("\\") + c;
        } else {
            out += c;
        }
    }
    return out;
}

std::string zsh_script(const CLI::App& parser) {
    std::string commands, cases;
    for (const CLI::App* command : parser.get_subcommands({})) {
        commands += "    '" + command->get_name() + ":" + quoted(command->get_description(), true) + "'\n";
        cases += "    " + command->get_name() + ")\n      _arguments";
        for (const Flag& flag : flags_of(*command)) {
            for (const std::string& name : flag.names) {
                cases += " \\\n        '" + name + "[" + quoted(flag.description, true) + "]" +
                         (!flag.takes_value  ? ""
                          : name == "--only" ? ":board:(sim linux)"
                                             : ":value:_files") +
                         "'";
            }
        }
        cases += command->get_name() == "completion" ? " \\\n        '1:shell:(bash zsh fish)'"
                 : takes_files(*command)             ? " \\\n        '1:sketch:_files'"
                                                     : "";
        cases += "\n      ;;\n";
    }
    return "#compdef qduino\n"
           "_qduino() {\n"
           "  local -a commands\n"
           "  commands=(\n" +
           commands +
           "  )\n"
           "  if (( CURRENT == 2 )); then\n"
           "    _describe command commands\n"
           "    return\n"
           "  fi\n"
           "  local command=$words[2]\n"
           "  shift words\n"
           "  (( CURRENT-- ))\n"
           "  case $command in\n" +
           cases +
           "  esac\n"
           "}\n"
           "if [ \"$funcstack[1]\" = _qduino ]; then\n"  // loaded from $fpath; otherwise sourced
           "  _qduino \"$@\"\n"
           "else\n"
           "  compdef _qduino qduino\n"
           "fi\n";
}

std::string fish_script(const CLI::App& parser) {
    std::string out = "# fish completion for qduino\ncomplete -c qduino -n __fish_use_subcommand -f\n";
    for (const CLI::App* command : parser.get_subcommands({})) {
        out += "complete -c qduino -n __fish_use_subcommand -a " + command->get_name() + " -d '" +
               quoted(command->get_description(), false) + "'\n";
        for (const Flag& flag : flags_of(*command)) {
            out += "complete -c qduino -n '__fish_seen_subcommand_from " + command->get_name() + "'";
            for (const std::string& name : flag.names) {
                out += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
            }
            out += std::string(flag.takes_value ? " -r" : "") + " -d '" + quoted(flag.description, false) +
                   "'\n";
        }
    }
    out +=
        "complete -c qduino -n '__fish_seen_subcommand_from completion' -f -a 'bash zsh fish'\n"
        "complete -c qduino -n '__fish_seen_subcommand_from build' -l only -x -a 'sim linux'\n";
    return out;
}

}  // namespace

std::string completion_script(const CLI::App& parser, const std::string& shell) {
    if (shell == "bash") return bash_script(parser);
    if (shell == "zsh") return zsh_script(parser);
    if (shell == "fish") return fish_script(parser);
    return {};
}

}  // namespace qduino::apps
