"""HTML site of `dsl board`: `leaderboard_page` combines the result matrix, performance profiles and case cards."""
