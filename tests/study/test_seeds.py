from drake_aerial.study.seeds import seed_of


def test_seeds_differ_by_name_and_base_and_stay():
    seeds = {
        seed_of(base, *names)
        for base in (0, 1)
        for names in (("scan",), ("contacts",), ("flight", 0), ("flight", 1))
    }
    assert len(seeds) == 8
    assert all(0 <= seed < 2**31 for seed in seeds)
    # A name is one name: what is joined differently is another.
    assert seed_of(0, "flight", 11) != seed_of(0, "flight", 1, 1)
    # Records made by another machine or version of NumPy are the same study.
    assert seed_of(0, "scan") == SCAN


SCAN = 950765349
