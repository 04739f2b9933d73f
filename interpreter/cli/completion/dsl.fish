# completion of dsl for fish: dsl completion fish | source
function __dsl_answers
    set -l words (commandline -opc) (commandline -ct | string unescape)
    test (count $words) -gt (count (commandline -opc)); or set -a words ''
    printf '%s\0' $words[2..-1] | dsl completion answers 2>/dev/null
end
complete -c dsl -f -k -a '(__dsl_answers)'
