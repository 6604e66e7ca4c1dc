!> Damped modes of nearly equal eigenvalues, which inverse iteration does not tell apart: together.
!>
!> Inverse iteration with one shift for all of them gives the space of their motions. In it T(lambda) x = 0, linear in lambda
!> about the shift, is a small eigenvalue problem; as T is symmetric, its values have an error of second order.
module nocdyn_mode_clusters
  use nocdyn_dynamic_stiffness, only: band_work_t, dynamic_stiffness_t, rigid_stiffness
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_complex, only: complex_eigenvectors
  use nocdyn_machine, only: machine_t
  use nocdyn_mode_pairs, only: masses_times, mode_pairs_t, set_motion
  implicit none (type, external)
  private

  public :: refine_cluster

contains

  !> Refines the modes that are as good as equal to one of them.
  subroutine refine_cluster(machine, matrix, work, pairs, m, is_exact)
    type(machine_t), intent(in) :: machine              !! one lane
    type(dynamic_stiffness_t), intent(in) :: matrix     !! of it
    type(band_work_t), intent(inout) :: work
    type(mode_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: m                            !! that mode
    logical, intent(inout) :: is_exact(:)               !! gets true where the refinement has worked, [modes]
    integer, parameter :: most = 60, rounds = 3
    real(wp), parameter :: near = 1.0e-5_wp, beside = 1.0e-8_wp   ! relative
    complex(wp) :: shift, stiffness(size(pairs%twist, 1))
    integer, allocatable :: cluster(:)
    integer :: i, k, round
    logical :: singular

    cluster = pack([(k, k=1, size(pairs%value))], abs(pairs%value - pairs%value(m)) <= near * abs(pairs%value(m)) .and. &
                   pairs%internal == 0)
    if (size(cluster) > most .or. .not. aimag(pairs%value(m)) > 0) return
    shift = sum(pairs%value(cluster)) / size(cluster) * (1.0_wp + beside)
    call pairs%slopes%find_stiffness(machine%elements%internal, shift, stiffness)
    if (allocated(pairs%locked)) stiffness(pairs%locked) = rigid_stiffness
    call matrix%factor_square(-shift**2, stiffness, work, singular)
    if (singular) return
    do round = 1, rounds
      do i = 1, size(cluster)
        associate (x => pairs%x(:, cluster(i)))
          do k = 1, i - 1   ! motions that are independent
            x = x - sum(conjg(pairs%x(:, cluster(k))) * x) * pairs%x(:, cluster(k))
          end do
          work%x(:) = (0.0_wp, 0.0_wp)
          work%x(matrix%position(:matrix%coordinates)) = masses_times(machine, x)
          call matrix%solve(work)
          x = work%x(matrix%position(:matrix%coordinates))
          do k = 1, i - 1
            x = x - sum(conjg(pairs%x(:, cluster(k))) * x) * pairs%x(:, cluster(k))
          end do
          x = x / sqrt(sum(abs(x)**2))
        end associate
      end do
    end do
    call solve_projected(machine, matrix, pairs, cluster, shift, is_exact)
  end subroutine refine_cluster

  !> The modes in the space of the motions.
  subroutine solve_projected(machine, matrix, pairs, cluster, shift, is_exact)
    type(machine_t), intent(in) :: machine
    type(dynamic_stiffness_t), intent(in) :: matrix
    type(mode_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: cluster(:)    !! modes
    complex(wp), intent(in) :: shift     !! [1/s]
    logical, intent(inout) :: is_exact(:)
    real(wp), parameter :: near = 1.0e-4_wp
    complex(wp), dimension(size(cluster), size(cluster)) :: change, residual, vectors
    complex(wp), dimension(size(pairs%twist, 1)) :: slope, stiffness
    complex(wp) :: values(size(cluster)), x(size(pairs%x, 1), size(cluster))
    integer :: i, k
    logical :: has_failed

    call pairs%slopes%find_stiffness(machine%elements%internal, shift, stiffness, slope)
    do i = 1, size(cluster)
      call set_motion(machine, matrix, pairs, cluster(i))
    end do
    do i = 1, size(cluster)
      do k = 1, size(cluster)
        associate (twists => pairs%twist(:, cluster(i)) * pairs%twist(:, cluster(k)), &
                   inertia => sum(machine%inertia(1, :) * pairs%angle(:, cluster(i)) * pairs%angle(:, cluster(k))))
          residual(i, k) = sum(stiffness * twists) + shift**2 * inertia
          change(i, k) = -(sum(slope * twists) + 2.0_wp * shift * inertia)
        end associate
      end do
    end do
    call complex_eigenvectors(residual, change, values, vectors, has_failed)
    if (has_failed .or. .not. all(abs(values) <= near * abs(shift))) return
    x = matmul(pairs%x(:, cluster), vectors)
    do i = 1, size(cluster)
      pairs%value(cluster(i)) = shift + values(i)
      pairs%x(:, cluster(i)) = x(:, i)
      call set_motion(machine, matrix, pairs, cluster(i))
    end do
    is_exact(cluster) = .true.
  end subroutine solve_projected

end module nocdyn_mode_clusters
