; What the actions of one-kit.pddl need and do, so that the plan can be checked without an arm:
;   canter plan-check examples/kitting/one-kit.pddl \
;     --domain examples/kitting/one-kit-domain.pddl --problem examples/kitting/one-kit-problem.pddl
(define (domain one-kit)
  (:requirements :typing :negative-preconditions :numeric-fluents)
  (:types
    thing place effector robot - object
    part tray kit - thing
    holder table supply receiver - place
    tray-supply part-supply - supply)
  (:predicates
    (at ?t - thing ?p - object)        ; a thing is in or on a place, in a kit, or held by the robot
    (kept ?e - effector ?h - holder)   ; an effector is in its holder
    (wears ?r - robot ?e - effector)   ; an effector is on the arm
    (bare ?r - robot)                  ; no effector is on the arm
    (holds ?r - robot ?t - thing)
    (carries ?e - effector ?t - thing) ; an effector fits a thing
    (made-of ?k - kit ?t - tray)
    (free ?t - table))
  (:functions (left ?s - supply) (steps))

  (:action attach-eff
    :parameters (?r - robot ?e - effector ?h - holder)
    :precondition (and (bare ?r) (kept ?e ?h))
    :effect (and (wears ?r ?e) (not (bare ?r)) (not (kept ?e ?h)) (increase (steps) 1)))

  (:action remove-eff
    :parameters (?r - robot ?e - effector ?h - holder)
    :precondition (and (wears ?r ?e) (not (kept ?e ?h)))
    :effect (and (bare ?r) (kept ?e ?h) (not (wears ?r ?e)) (increase (steps) 1)))

  (:action take-kit-tray
    :parameters (?r - robot ?t - tray ?s - tray-supply ?e - effector ?w - table)
    :precondition (and (wears ?r ?e) (carries ?e ?t) (at ?t ?s) (>= (left ?s) 1) (free ?w))
    :effect (and (holds ?r ?t) (at ?t ?r) (not (at ?t ?s)) (decrease (left ?s) 1)
                 (increase (steps) 1)))

  (:action put-kit-tray
    :parameters (?r - robot ?t - tray ?w - table)
    :precondition (and (holds ?r ?t) (free ?w))
    :effect (and (at ?t ?w) (not (at ?t ?r)) (not (holds ?r ?t)) (not (free ?w))
                 (increase (steps) 1)))

  (:action create-kit
    :parameters (?k - kit ?t - tray ?w - table)
    :precondition (at ?t ?w)
    :effect (and (made-of ?k ?t) (at ?k ?w) (not (at ?t ?w)) (increase (steps) 1)))

  (:action take-part
    :parameters (?r - robot ?p - part ?s - part-supply ?e - effector ?w - table ?k - kit)
    :precondition (and (wears ?r ?e) (carries ?e ?p) (at ?p ?s) (at ?k ?w)
                       (or (> (left ?s) 0) (= ?w ?w)))
    :effect (and (holds ?r ?p) (at ?p ?r) (not (at ?p ?s)) (decrease (left ?s) 1)
                 (increase (steps) 1)))

  (:action put-part
    :parameters (?r - robot ?p - part ?k - kit ?w - table)
    :precondition (and (holds ?r ?p) (at ?k ?w))
    :effect (and (at ?p ?k) (not (at ?p ?r)) (not (holds ?r ?p)) (increase (steps) 1)))

  (:action take-kit
    :parameters (?r - robot ?k - kit ?w - table ?e - effector)
    :precondition (and (wears ?r ?e) (carries ?e ?k) (at ?k ?w))
    :effect (and (holds ?r ?k) (at ?k ?r) (not (at ?k ?w)) (free ?w) (increase (steps) 1)))

  (:action put-kit
    :parameters (?r - robot ?k - kit ?b - receiver)
    :precondition (holds ?r ?k)
    :effect (and (at ?k ?b) (not (at ?k ?r)) (not (holds ?r ?k)) (increase (steps) 1))))
