!> The stages of a Runge-Kutta or Rosenbrock method on a block of lanes, and their weighted sums.
module nocdyn_stages
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_stage_sums, only: large_tile, padded_columns, set_offsets, stage_sum, stage_sum_t, sum_stages
  use nocdyn_step_attempt, only: attempt_not_finite, disable_lane, disable_non_finite_lanes, step_attempt_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: set_tableau, share_storage, allocate_stages, stage_state, update_state, estimate_error, form_dense_output

  type, public :: stages_t
    integer :: step = 0                            !! number of stages of a step
    integer :: all = 0                             !! number of all stages, with the stages that only the dense output needs
    type(stage_sum_t), allocatable :: internal(:)  !! rows of the tableau: states at which the stages are evaluated
    type(stage_sum_t) :: update                    !! weights of y_new
    type(stage_sum_t) :: error                     !! weights of the error estimate
    type(stage_sum_t) :: low_order_error           !! weights of the second error estimate; no terms: there is none
    type(stage_sum_t), allocatable :: dense(:)     !! weights of each power of theta = (time - t) / h
    integer :: k_count = 0                         !! number of stages that `k` has room for
    integer, allocatable :: k_index(:)             !! index in `k` of each stage, [all]
    real(wp), allocatable :: k(:, :, :)            !! the stages, [lanes, padded columns, k_count]
    real(wp), allocatable :: zero(:)               !! zeros, as long as a stage or a large tile
  end type stages_t

contains

  !> Sets the sums from the rows of a tableau, without the zeros.
  pure subroutine set_tableau(self, internal, update, error, dense)
    type(stages_t), intent(inout) :: self
    real(wp), intent(in) :: internal(:, :)   !! shape [all, all]
    real(wp), intent(in) :: update(:)        !! shape [step]
    real(wp), intent(in) :: error(:)         !! shape [step]
    real(wp), intent(in) :: dense(:, :)      !! shape [all, degree]
    integer :: i

    self%step = size(update)
    self%all = size(internal, 1)
    self%k_count = self%all
    self%k_index = [(i, i=1, self%all)]
    allocate (self%internal(self%all), self%dense(size(dense, 2)))
    do i = 1, self%all
      self%internal(i) = stage_sum(internal(i, :))
    end do
    self%update = stage_sum(update)
    self%error = stage_sum(error)
    do i = 1, size(dense, 2)
      self%dense(i) = stage_sum(dense(:, i))
    end do
  end subroutine set_tableau

  !> Lets stages share memory once all weights are set: a stage overwrites one that no later sum reads. Stage i is written after
  !> its state has been formed. The first stage and the last two stages of a step are never overwritten.
  pure subroutine share_storage(self)
    type(stages_t), intent(inout) :: self
    type(stage_sum_t) :: sums(self%all + 3 + size(self%dense))
    integer :: read_at(size(sums))   ! stage at which each sum is formed
    integer :: last_read(self%all)   ! first stage that may overwrite each stage
    integer :: owner(self%all)       ! stage at each index of `k`
    integer :: i, k_index, stage

    sums = [self%internal, self%update, self%error, self%low_order_error, self%dense]
    read_at = [(i, i=1, self%all), (self%step + 1, i=1, 3), (self%all + 1, i=1, size(self%dense))]
    last_read = 0
    do i = 1, size(sums)
      associate (read => sums(i)%stages(:sums(i)%terms))
        last_read(read) = max(last_read(read), read_at(i))
      end associate
    end do
    last_read([1, self%step - 1, self%step]) = self%all + 1
    self%k_count = 0
    do stage = 1, self%all
      do k_index = 1, self%k_count
        if (last_read(owner(k_index)) <= stage) exit
      end do
      self%k_count = max(self%k_count, k_index)
      owner(k_index) = stage
      self%k_index(stage) = k_index
    end do
    do i = 1, size(sums)
      associate (read => sums(i)%stages(:sums(i)%terms))
        read = self%k_index(read)
      end associate
    end do
    self%internal = sums(:self%all)
    self%update = sums(self%all + 1)
    self%error = sums(self%all + 2)
    self%low_order_error = sums(self%all + 3)
    self%dense = sums(self%all + 4:)
  end subroutine share_storage

  !> Allocates the stages of every lane.
  subroutine allocate_stages(self, system)
    type(stages_t), intent(inout) :: self
    class(system_t), intent(in) :: system
    integer :: columns

    if (allocated(self%k)) deallocate (self%k, self%zero)
    associate (lanes => system%lanes)
      columns = padded_columns(lanes, system%states + system%quadratures)
      allocate (self%k(lanes, columns, self%k_count), self%zero(min(lanes * columns, large_tile)), source=0.0_wp)
      call set_offsets(self%internal, lanes * columns, self%k_count)
      call set_offsets(self%update, lanes * columns, self%k_count)
      call set_offsets(self%error, lanes * columns, self%k_count)
      call set_offsets(self%low_order_error, lanes * columns, self%k_count)
      call set_offsets(self%dense, lanes * columns, self%k_count)
    end associate
  end subroutine allocate_stages

  !> The state at which a stage is evaluated, from the stages before it. Disables lanes where it is not finite.
  pure subroutine stage_state(self, attempt, stage, y)
    type(stages_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    integer, intent(in) :: stage
    real(wp), intent(inout) :: y(attempt%length)
    logical :: all_finite

    call sum_stages(self%internal(stage), self%k, attempt%length, attempt%y, attempt%h_length, attempt%h_spread, y, all_finite)
    if (.not. all_finite) call disable_overflowed_lanes(self, attempt, y)
  end subroutine stage_state

  !> Disables the lanes where y is not finite: resets y to the start of the step and clears their stages.
  pure subroutine disable_overflowed_lanes(self, attempt, y)
    type(stages_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    real(wp), intent(inout) :: y(attempt%lanes, attempt%components)
    integer :: lane

    do lane = 1, attempt%lanes
      if (all(is_finite(y(lane, :)))) cycle
      if (attempt%active(lane)) self%k(lane, :, 2:) = 0.0_wp
      call disable_lane(attempt, lane, attempt_not_finite, findloc(is_finite(y(lane, :)), .false., dim=1))
      y(lane, :) = attempt%y(lane, :attempt%components)
    end do
  end subroutine disable_overflowed_lanes

  !> Sets y_new once its stages are known. Disables lanes where it is not finite.
  pure subroutine update_state(self, attempt)
    type(stages_t), intent(in) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical :: all_finite

    call sum_stages(self%update, self%k, attempt%length, attempt%y, attempt%h_length, attempt%h_spread, attempt%y_new, all_finite)
    if (.not. all_finite) call disable_non_finite_lanes(attempt, attempt%y_new)
  end subroutine update_state

  !> y = h times a sum of stages.
  pure subroutine scaled_sum(stage_sum, self, attempt, y, all_finite)
    type(stage_sum_t), intent(in) :: stage_sum
    type(stages_t), intent(in) :: self
    type(step_attempt_t), intent(in) :: attempt
    real(wp), intent(inout) :: y(attempt%length)
    logical, intent(out), optional :: all_finite

    call sum_stages(stage_sum, self%k, size(self%zero), self%zero, attempt%h_length, attempt%h_spread, y, all_finite)
  end subroutine scaled_sum

  !> Sets the error estimates once all stages of the step are known. Disables lanes where one is not finite.
  pure subroutine estimate_error(self, attempt)
    type(stages_t), intent(in) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical :: all_finite

    call scaled_sum(self%error, self, attempt, attempt%error_estimate, all_finite)
    if (.not. all_finite) call disable_non_finite_lanes(attempt, attempt%error_estimate)
    if (.not. attempt%has_low_order_estimate) return
    call scaled_sum(self%low_order_error, self, attempt, attempt%low_order_estimate, all_finite)
    if (.not. all_finite) call disable_non_finite_lanes(attempt, attempt%low_order_estimate)
  end subroutine estimate_error

  !> Dense output of the last step: y + sum over p of coefficients(:, :, p) theta^p, in the columns first_dense to last_dense.
  pure subroutine form_dense_output(self, attempt, coefficients)
    type(stages_t), intent(in) :: self
    type(step_attempt_t), intent(in) :: attempt
    real(wp), intent(inout) :: coefficients(attempt%length, size(self%dense))   !! [lanes * padded columns, degree]
    type(stage_sum_t) :: part
    integer :: before, power

    if (attempt%last_dense - attempt%first_dense + 1 == size(attempt%y, 2)) then
      do power = 1, size(self%dense)
        call scaled_sum(self%dense(power), self, attempt, coefficients(:, power))
      end do
      return
    end if
    before = attempt%lanes * (attempt%first_dense - 1)
    do power = 1, size(self%dense)
      part = self%dense(power)
      part%length = attempt%lanes * (attempt%last_dense - attempt%first_dense + 1)
      part%extent = part%extent - before
      call sum_stages(part, self%k(1, attempt%first_dense, 1), min(part%length, size(self%zero)), self%zero, &
                   min(part%length, attempt%h_length), attempt%h_spread, coefficients(before + 1, power))
    end do
  end subroutine form_dense_output

end module nocdyn_stages
