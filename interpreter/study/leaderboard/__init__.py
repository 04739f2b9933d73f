"""The board: every model on every case of a suite, by the protocol of `dsl compare`.

`suite` reads which cases there are and `cases` holds them against their scenes; `cells` makes a board of what was
compared, `profiles` and `merits` say what it shows, and `against` what has changed since another board.
"""
