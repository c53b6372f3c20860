from scenarios import assert_scenario


def test_our_cell_keeps_its_accuracy():
    assert_scenario("our-cell.toml", seeds=range(20))
