; The start and the goal of one-kit.pddl.
(define (problem one-kit-of-four-parts)
  (:domain one-kit)
  (:objects
    robot_1 - robot
    tray_gripper part_gripper - effector
    tray_gripper_holder part_gripper_holder - holder
    work_table_1 - table
    empty_kit_tray_supply - tray-supply
    part_a_tray part_b_tray part_c_tray - part-supply
    finished_kit_receiver - receiver
    kit_tray_1 - tray
    kit_1 - kit
    part_a_1 part_a_2 part_b_1 part_c_1 - part)
  (:init
    (bare robot_1)
    (kept tray_gripper tray_gripper_holder)
    (kept part_gripper part_gripper_holder)
    (carries tray_gripper kit_tray_1)
    (carries tray_gripper kit_1)
    (carries part_gripper part_a_1) (carries part_gripper part_a_2)
    (carries part_gripper part_b_1) (carries part_gripper part_c_1)
    (free work_table_1)
    (at kit_tray_1 empty_kit_tray_supply)
    (at part_a_1 part_a_tray) (at part_a_2 part_a_tray)
    (at part_b_1 part_b_tray) (at part_c_1 part_c_tray)
    (= (left empty_kit_tray_supply) 1)
    (= (left part_a_tray) 2) (= (left part_b_tray) 1) (= (left part_c_tray) 1)
    (= (steps) 0))
  (:goal
    (and (at kit_1 finished_kit_receiver)
         (at part_a_1 kit_1) (at part_a_2 kit_1) (at part_b_1 kit_1) (at part_c_1 kit_1)
         (= (left part_a_tray) 0)
         (= (steps) 18))))
