"""A user's own copy of a public dataset, cut into sessions as Milef et al. (2024) did to evaluate theirs."""
