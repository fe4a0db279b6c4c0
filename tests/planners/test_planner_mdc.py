from .situation import Situation, near
def test_x():
    s = Situation("mdc", [(0.,0.)],[30]).plan()
    assert s.heading()==near(30)
