# completion of dsl for bash: eval "$(dsl completion bash)"
_dsl() {
  local word words=("${COMP_WORDS[@]:1:COMP_CWORD}")
  COMPREPLY=()
  while IFS=$'\t' read -r word _; do
    [[ $word == *[!A-Za-z0-9_./=:,+%@^~-]* ]] && printf -v word %q "$word"
    COMPREPLY+=("$word")
  done < <(printf '%s\0' "${words[@]//\\/}" | dsl completion answers 2>/dev/null)
  [[ ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == *[=/] ]] && compopt -o nospace 2>/dev/null
  return 0
}
complete -F _dsl dsl
