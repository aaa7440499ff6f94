# Completion of `bielle` for bash. Commands, options and their values are those that the program's own --help tells, so
# that this file knows none of them.

# The names that stand first in the lines of a section of the help: _bielle_section HELP TITLE
_bielle_section() {
  awk -v title="$2:" '$0 == title { inside = 1; next } /^[^ ]/ || /^$/ { inside = 0 } inside && /^  [^ ]/ { print $1 }' <<<"$1"
}

# The line of an option in the help: _bielle_option HELP --NAME
_bielle_option() {
  awk -v name="$2" '/^  -/ { n = split($1, names, ","); for (i = 1; i <= n; ++i) if (names[i] == name) { print; exit } }' <<<"$1"
}

_bielle() {
  local program=${COMP_WORDS[0]} current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]}
  local path=() index help commands option choices=""
  help=$("$program" --help 2>/dev/null)
  commands=$(_bielle_section "$help" Subcommands)
  for ((index = 1; index < COMP_CWORD; ++index)); do
    grep -qxF -- "${COMP_WORDS[index]}" <<<"$commands" || break
    path+=("${COMP_WORDS[index]}")
    help=$("$program" "${path[@]}" --help 2>/dev/null)
    commands=$(_bielle_section "$help" Subcommands)
  done

  COMPREPLY=()
  option=$(_bielle_option "$help" "$before")
  if [[ $option =~ ^\ +[^\ ]+\ +(TEXT|INT|FLOAT|UINT) ]]; then  # the value of an option
    if [[ $before == --robot ]]; then
      choices=$("$program" robots 2>/dev/null | awk '{ print $1 }')
    elif [[ $option =~ \{([^}]*)\} ]]; then
      choices=${BASH_REMATCH[1]//,/ }
    fi
  elif [[ $current == -* ]]; then
    choices=$(_bielle_section "$help" Options | tr ',' '\n')
  elif [[ -n $commands ]]; then
    choices=$commands
  else
    option=$(grep -A1 '^Positionals:' <<<"$help" | tail -1)
    if [[ $option =~ ^\ +(ROBOT|robot) ]]; then
      choices=$("$program" robots 2>/dev/null | awk '{ print $1 }')
    elif [[ $option =~ \{([^}]*)\} ]]; then
      choices=${BASH_REMATCH[1]//,/ }
    fi
  fi
  mapfile -t COMPREPLY < <(compgen -W "$choices" -- "$current")
}
complete -o default -F _bielle bielle
