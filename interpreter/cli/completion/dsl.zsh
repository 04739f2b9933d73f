#compdef dsl
# completion of dsl for zsh: eval "$(dsl completion zsh)", behind `autoload -U compinit && compinit`
_dsl() {
  local line word
  local -a plain shown open
  for line in "${(@f)$(printf '%s\0' "${(@Q)words[2,CURRENT]}" | dsl completion answers 2>/dev/null)}"; do
    word=${line%%$'\t'*}
    [[ -n $word ]] || continue
    if [[ $word == *[=/] ]]; then open+=("$word"); continue; fi
    plain+=("$word") shown+=("$word${${line#$word}:+  -- ${line#*$'\t'}}")
  done
  compadd -S '' -a open
  compadd -l -d shown -a plain
}
compdef _dsl dsl
